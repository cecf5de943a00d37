// A report in headless Chromium, used as a person would: loads from disk without network, sorts, filters, zooms, overlays, prints.
// Arguments: report.html, of the actuator or with "brief" of a system with ticks of 25 us, some axes in one unit and nothing to choose;
// with "large" of which runs are listed in part; or the address of a live page and "live". Speaks the DevTools protocol over a pipe, so that it needs no
// library. Prints a line a check; exit code 1 with the reason at the first that fails.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [target, mode] = process.argv.slice(2);
const profile = mkdtempSync(join(tmpdir(), "solenoid-chromium-"));
const browser = spawn("chromium", ["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--remote-debugging-pipe", "--disable-dev-shm-usage",
  "--disable-background-networking", `--user-data-dir=${profile}`, "about:blank"], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });

let last = 0, rest = "";
const waiting = new Map(), troubles = [], requests = [];
browser.stdio[4].on("data", (data) => {
  rest += data;
  for (let end; (end = rest.indexOf("\0")) >= 0; rest = rest.slice(end + 1)) {
    const message = JSON.parse(rest.slice(0, end));
    if (message.id) {
      const { done, failed } = waiting.get(message.id);
      waiting.delete(message.id);
      if (message.error) failed(new Error(message.error.message));
      else done(message.result);
    } else if (message.method === "Runtime.exceptionThrown") troubles.push(message.params.exceptionDetails.exception?.description ?? message.params.exceptionDetails.text);
    else if (message.method === "Runtime.consoleAPICalled" || message.method === "Log.entryAdded") troubles.push(JSON.stringify(message.params).slice(0, 400));
    else if (message.method === "Network.requestWillBeSent") requests.push(message.params.request.url);
  }
});
const call = (method, params = {}, sessionId) => new Promise((done, failed) => {
  waiting.set(++last, { done, failed });
  browser.stdio[3].write(JSON.stringify({ id: last, method, params, sessionId }) + "\0");
});
const pause = (ms) => new Promise((done) => setTimeout(done, ms));

let session;
const page = (method, params) => call(method, params, session);
async function evaluate(expression) {
  const { result, exceptionDetails } = await page("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
  if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description ?? exceptionDetails.text}`);
  return result.value;
}
async function until(expression, what, seconds = 30) {
  for (let tries = 0; tries < seconds * 20; ++tries) {
    if (await evaluate(expression)) return;
    await pause(50);
  }
  throw new Error(`never came: ${what}`);
}
function check(holds, what) {
  if (!holds) throw new Error(`does not hold: ${what}`);
  console.log(`ok  ${what}`);
}
const column = (table, heading) => evaluate(`(() => {
  const place = [...document.querySelectorAll("#${table} thead th")].findIndex((th) => th.textContent.startsWith("${heading}"));
  return [...document.querySelectorAll("#${table} tbody tr")].map((tr) => tr.children[place].textContent);
})()`);
const numbers = (texts) => texts.map((text) => Number(text.replace("*", "").replace("\u2212", "-")));
const increasing = (list) => list.every((value, i) => i === 0 || list[i - 1] <= value);
const click = (selector) => evaluate(`document.querySelector(${JSON.stringify(selector)}).click()`);
const choose = (id, value) => evaluate(`{ const s = document.getElementById("${id}"); s.value = ${JSON.stringify(value)}; s.dispatchEvent(new Event("change")); s.dispatchEvent(new Event("input")); }`);
const curves = async () => JSON.parse(await evaluate(`JSON.stringify(document.getElementById("curves").dataset)`));
const colours = () => evaluate(`(() => {  // of the error plot's curves
  const canvas = document.querySelectorAll("#curves canvas")[1], data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let a = 0, b = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i + 3] < 200) continue;
    if (data[i + 2] > data[i] + 80) ++a;
    if (data[i] > data[i + 2] + 80) ++b;
  }
  return { a, b };
})()`);

async function open() {
  const { targetInfos } = await call("Target.getTargets");
  ({ sessionId: session } = await call("Target.attachToTarget", { targetId: targetInfos.find(({ type }) => type === "page").targetId, flatten: true }));
  for (const domain of ["Runtime", "Log", "Page", "Network"]) await page(`${domain}.enable`);
  await page("Emulation.setDeviceMetricsOverride", { width: 1280, height: 800, deviceScaleFactor: 1, mobile: false });
  if (mode !== "live") await page("Network.emulateNetworkConditions", { offline: true, latency: 0, downloadThroughput: 0, uploadThroughput: 0 });
  await page("Page.navigate", { url: mode === "live" ? target : pathToFileURL(resolve(target)).href });
  await until(`document.documentElement?.dataset.ready === "true"`, "the page's own word that it is ready");
  const opened = await evaluate(`new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now()))))`);
  console.log(`--  read and drawn ${Math.round(opened)} ms after the browser was sent to it`);
}

async function tables() {
  check(increasing(numbers(await column("ranked", "RMSE"))), "the ranking begins with the least RMSE");
  await click(`#ranked th[data-key="switches_per_s"] button`);
  check(increasing(numbers(await column("ranked", "Switches"))), "the ranking sorts by switches");
  check((await evaluate(`document.querySelector('#ranked th[data-key="switches_per_s"]').ariaSort`)) === "ascending", "the heading says how it is sorted");
  await click(`#ranked th[data-key="switches_per_s"] button`);
  check(increasing(numbers(await column("ranked", "Switches")).reverse()), "the ranking sorts the other way round");
  check((await evaluate(`document.activeElement.closest("th")?.dataset.key`)) === "switches_per_s", "the keyboard's focus stays on the heading");
  const all = (await column("run-table", "Variant")).length;
  await choose("variant", "nine_pd");
  const few = await column("run-table", "Variant");
  check(few.length > 0 && few.length < all && few.every((name) => name === "nine_pd"), "runs are filtered by variant");
  await evaluate(`{ const s = document.getElementById("search"); s.value = "seed 4 step"; s.dispatchEvent(new Event("input")); }`);
  check((await column("run-table", "Seed")).join() === "4", "runs are searched by words");
  await evaluate(`{ const s = document.getElementById("search"); s.value = ""; s.dispatchEvent(new Event("input")); }`);
  await choose("variant", "");
  await click(`#run-table th[data-key="rmse_mm"] button`);
  check(increasing(numbers(await column("run-table", "RMSE"))), "runs sort by RMSE");
  check((await evaluate(`document.querySelectorAll("#pareto svg circle").length`)) === 2 * (await column("ranked", "Variant")).length, "each ranked variant is a point of both Pareto plots");
  const [ratio] = numbers(await column("paired-table", "Ratio")), baseline = await evaluate(`document.getElementById("baseline").value`), [other] = await column("paired-table", "Variant");
  check(ratio >= 1 && baseline === (await evaluate(`JSON.parse(document.getElementById("data").textContent).rankings[0].variants[0].variant`)), "variants are paired with the best ranked");
  await choose("baseline", other);
  check((await column("paired-table", "Variant")).join() === baseline && Math.abs(numbers(await column("paired-table", "Ratio"))[0] * ratio - 1) < 0.01, "another baseline turns the ratio round");
  await choose("baseline", baseline);
  check((await evaluate(`document.querySelectorAll("#profile path.curve").length`)) === 2, "a performance profile a variant");
  check((await evaluate(`document.querySelectorAll("#histograms svg .deadline").length`)) > 0, "solver times have the line of the period");
  await choose("group", "1");
  check((await evaluate(`document.getElementById("ranking-note").textContent`)).includes("1 of 1 scenario"), "the ranking over one scenario");
  await choose("group", "0");
}

async function plots() {
  await until(`document.querySelectorAll("#curves .uplot").length === 5`, "five plots");
  const long = await evaluate(`[...document.getElementById("run-a").options].map((o) => o.value).find((id) => id.startsWith("long"))`);
  await choose("run-a", long);
  await until(`document.querySelectorAll("#curves .uplot").length === 5 && Number(document.getElementById("curves").dataset.to) > 24`, "the long run");
  check((await curves()).detail === "overview", "a long run is drawn from its overview");
  let drawn = await colours();
  check(drawn.a > 100 && drawn.b === 0, "one run is drawn in its colour");
  await evaluate(`document.getElementById("plots").scrollIntoView()`);
  const box = JSON.parse(await evaluate(`JSON.stringify(document.querySelectorAll("#curves .u-over")[1].getBoundingClientRect())`));
  const mouse = (type, x, button, buttons) => page("Input.dispatchMouseEvent", { type, x: box.x + x, y: box.y + 20, button, buttons, clickCount: 1 });
  await mouse("mouseMoved", 0.25 * box.width, "none", 0);
  await mouse("mousePressed", 0.25 * box.width, "left", 1);
  await mouse("mouseMoved", 0.4 * box.width, "left", 1);
  await mouse("mouseMoved", 0.5 * box.width, "left", 1);
  await mouse("mouseReleased", 0.5 * box.width, "left", 0);
  await until(`document.getElementById("curves").dataset.detail === "full"`, "every tick after zooming");
  const { from, to } = await curves();
  check(Math.abs(from - 6.25) < 0.2 && Math.abs(to - 12.5) < 0.2, "dragging zooms all plots to what was dragged across");
  await mouse("mouseMoved", 0.5 * box.width, "none", 0);
  const readout = numbers(await column("readout", "time"));
  check(readout[0] > from && readout[0] < to, "the cursor reads out values");
  const id = await evaluate(`[...document.getElementById("run-b").options].map((o) => o.value).find((id) => id.startsWith("long--nine_pd"))`);
  await choose("run-b", id);
  await until(`document.querySelectorAll("#readout tbody tr").length === 2`, "two runs read out");
  drawn = await colours();
  check(drawn.a > 100 && drawn.b > 100, "a second run lies over the first in another colour");
  check((await evaluate(`document.getElementById("metrics").textContent`)).includes("RMSE, true position"), "metrics beside each other");
  await choose("choice-fourth", "pressure");
  check((await evaluate(`[...document.querySelectorAll("#curves [role=img]")][3].getAttribute("aria-label")`)).startsWith("pressure [kPa]"), "pressures in place of force");
  await evaluate(`document.getElementById("curves").focus()`);
  const key = (name) => page("Input.dispatchKeyEvent", { type: "keyDown", key: name });
  await key("ArrowRight");
  await key("ArrowRight");
  check((await evaluate(`document.getElementById("spoken").textContent`)).includes("position"), "the keyboard moves the cursor and says what is there");
  const before = await curves();
  await key("+");
  const after = await curves();
  check(after.to - after.from < 0.6 * (before.to - before.from), "the keyboard zooms");
  await key("0");
  check((await curves()).detail === "overview", "the keyboard shows the whole run again");
}

// A run of some hundredths of a second, of a system whose description alone the page knows.
async function brief() {
  await until(`document.querySelectorAll("#curves .uplot").length > 0`, "plots of another system");
  const labels = JSON.parse(await evaluate(`JSON.stringify([...document.querySelectorAll("#curves [role=img]")].map((e) => e.getAttribute("aria-label")))`));
  check(labels.length === 3 && labels.every((label) => / ms: /.test(label)), `a plot a panel, times in milliseconds: ${labels}`);
  check((await evaluate(`getComputedStyle(document.getElementById("choices")).display`)) === "none", "no list of choices where there are none");
  check((await evaluate(`document.querySelectorAll("#pareto svg").length`)) === 1, "a Pareto plot an effort");
  check((await column("ranked", "Error")).length > 0, "the ranking has the judged metric's heading");
  check((await evaluate(`document.querySelectorAll("#run-table tbody tr").length`)) > 0, "runs have their line");
  for (let i = 0; i < 20; ++i) await click("#zoom-in");
  const { from, to } = await curves();
  check(Math.abs(to - from - 10 * 25e-6) < 1e-9, "a zoom is at least ten ticks wide");
  await evaluate(`document.getElementById("curves").focus()`);
  await page("Input.dispatchKeyEvent", { type: "keyDown", key: "ArrowRight" });
  check(/^[0-9.]+ ms: .+ A, .+mode /.test(await evaluate(`document.getElementById("spoken").textContent`)), "the keyboard reads out what the panels have");
}

// Of some runs in a list, and numbers over all.
async function large() {
  const { listed, all, variants } = JSON.parse(await evaluate(`(() => {
    const { runs, counts, rankings } = JSON.parse(document.getElementById("data").textContent);
    return JSON.stringify({ listed: runs.length, all: counts, variants: rankings[0].variants });
  })()`));
  const text = (id) => evaluate(`document.getElementById("${id}").textContent`), grouped = (n) => n.toLocaleString("en");
  check(listed < all.runs && (await text("subtitle")).startsWith(`${grouped(all.runs)} runs: ${grouped(all.ok)} ok`), "the heading counts all runs");
  check((await text("count")) === `${grouped(listed)} of ${grouped(listed)} listed runs, of ${grouped(all.runs)}`, "the list says that it is a part");
  check((await text("runs-note")).startsWith(`${grouped(listed)} runs of ${grouped(all.runs)} are listed: `), "and which part");
  check((await evaluate(`document.querySelectorAll("#distribution path.curve").length`)) === variants.length, "a curve of the errors' distribution a variant");
  check((await evaluate(`document.querySelectorAll("#distribution .legend li").length`)) === variants.length, "a line of the legend a curve");
  const paired = JSON.parse(await evaluate(`JSON.stringify(JSON.parse(document.getElementById("data").textContent).rankings[0].paired)`));
  check((await column("paired-table", "Verdict")).join() === paired.variants.map((row) => row.verdict).join() && paired.variants.every((row) => row.verdict), "verdicts are those of the data");
  check((await column("paired-table", "95 %")).join() === paired.variants.map((row) => row.low.toFixed(4)).join(), "and so are the intervals");
  check((await text("paired-note")).includes(`all ${paired.comparisons} pairs`), "the note says what they are corrected for");
  const profiles = await evaluate(`[...document.querySelectorAll("#profile path.curve")].map((path) => path.getAttribute("d"))`);
  check(profiles.length === variants.length, "a performance profile a variant");
  check(profiles.every((path, i) => Math.abs((262 - Number(path.slice(0, path.lastIndexOf("H")).split(" ").at(-1))) / 240 - paired.profiles[i].ok / paired.profiles[i].runs) < 0.002), "which ends at the share of tasks that ended well");
  const { errors, ok, runs } = variants[0].distribution;
  const name = await evaluate(`document.querySelector("#distribution svg").getAttribute("aria-label")`);
  check(name.includes(`largest ${errors.at(-1).toPrecision(3)}`), "the drawing's name says its numbers");
  const path = await evaluate(`document.querySelector("#distribution path.curve").getAttribute("d")`);
  const points = path.slice(1, path.lastIndexOf("H")).split("L").map((point) => point.split(" ").map(Number));
  check(points.every(([x, y], i) => i === 0 || (x >= points[i - 1][0] && y <= points[i - 1][1])), "a curve never falls");
  const box = { left: 52, right: 752, top: 22, bottom: 262 }, share = (y) => (box.bottom - y) / (box.bottom - box.top);
  check(Math.abs(share(points.at(-1)[1]) - ok / runs) < 0.002, "it ends at the share of runs that ended well");
  const everything = variants.flatMap((v) => v.distribution.errors), most = Math.max(...everything), least = Math.max(Math.min(...everything), most / 1e6);
  const [low, high] = [least / 1.05, most * 1.05].map(Math.log10), x = (error) => box.left + ((Math.log10(error) - low) / (high - low)) * (box.right - box.left);
  const median = errors[Math.ceil(0.5 * errors.length) - 1];
  check(Math.abs(points.find(([, y]) => share(y) >= (0.5 * ok) / runs - 0.002)[0] - x(median)) < 3, "half of them are where the median is");
  const told = await evaluate(`[...document.querySelectorAll("#histograms svg")].map((svg) => svg.getAttribute("aria-label")).join("; ")`);
  check(variants.every((v) => told.includes(`${v.variant}: ${grouped(v.solves.counts.reduce((sum, n) => sum + n, 0))} solves`)), "solver times are of all runs");
}

async function looks() {
  const background = () => evaluate(`getComputedStyle(document.body).backgroundColor`);
  const light = await background();
  await page("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: "dark" }] });
  await until(`getComputedStyle(document.body).backgroundColor !== ${JSON.stringify(light)}`, "a dark page on a dark screen");
  check(true, "light and dark");
  const { data } = await page("Page.printToPDF", { preferCSSPageSize: true, printBackground: true });
  check(data.length > 20000 && Buffer.from(data, "base64").subarray(0, 5).toString() === "%PDF-", "it prints");
  const unnamed = await evaluate(`[...document.querySelectorAll("button, select, input, [role=img], [role=region], [role=group]")].filter((e) =>
    !(e.textContent.trim() && e.tagName === "BUTTON") && !e.ariaLabel && !e.labels?.length).map((e) => e.outerHTML.slice(0, 80))`);
  check(unnamed.length === 0, `every control and drawing has a name ${unnamed}`);
  check((await evaluate(`document.documentElement.scrollWidth <= innerWidth`)), "nothing is wider than the window");
}

async function live() {
  await until(`document.getElementById("live-state").textContent.startsWith("finished")`, "word that the campaign has finished", 120);
  check((await column("run-table", "Variant")).length === 8, "every run has come");
  await until(`document.querySelectorAll("#curves .uplot").length === 5`, "the curves of a run that was asked for");
  check(true, "curves are served");
}

const limit = setTimeout(() => { console.log("FAILED: took too long"); browser.kill("SIGKILL"); process.exit(1); }, 240000);
let code = 0;
try {
  await open();
  if (mode === "live") await live();
  else for (const part of mode === "brief" ? [brief, looks] : mode === "large" ? [large, looks] : [tables, plots, looks]) await part();
  check(troubles.length === 0, `nothing on the console ${troubles.join("; ")}`);
  check(mode === "live" || requests.every((url) => url.startsWith("file:") || url.startsWith("data:")), `no request but for the file itself ${requests.join(" ").slice(0, 300)}`);
} catch (problem) {
  console.log(`FAILED: ${problem.message}; console: ${troubles.join("; ")}`);
  code = 1;
}
clearTimeout(limit);
await Promise.race([call("Browser.close").catch(() => {}), pause(3000)]);
browser.kill("SIGKILL");
await Promise.race([new Promise((done) => browser.on("exit", done)), pause(2000)]);
// Children of a browser that was killed may write into its folder for a moment yet: that is no failure of the page.
for (let tries = 0; tries < 20; ++tries) {
  try {
    rmSync(profile, { recursive: true, force: true });
    break;
  } catch {
    await pause(200);
  }
}
process.exit(code);
