// A page that the program serves while it works: it asks for news every second.

const LIVE_RUN = { id: "now", name: "", trace: "live" };

// Curves of a run in real time, growing as its ticks arrive (a hundred a second).
class GrowingTrace {
  constructor() { this.start(""); }
  start(id) {
    this.id = id;
    this.received = 0;
    this.trace = null;
  }
  // {run, from, columns: {tick: [...], ...}, and what a trace's header says}: samples from number `from` on. True if anything is new.
  take(news) {
    if (!news.run) return false;
    if (news.run !== this.id || news.from !== this.received) this.start(news.run);
    if (news.from !== this.received || !news.columns.tick.length) return false;
    const columns = Object.fromEntries(Object.entries(news.columns).map(([name, values]) => [name, Float64Array.from(values, (v) => v ?? NaN)]));
    const fresh = inUnits(columns, news);
    this.received += fresh.time.length;
    this.trace = this.trace ? joined(this.trace, fresh) : fresh;
    return true;
  }
}

function joined(before, after) {
  const all = { ...after };
  for (const [name, values] of Object.entries(after)) {
    if (name === "header") continue;
    all[name] = new Float64Array(before[name].length + values.length);
    all[name].set(before[name]);
    all[name].set(values, before[name].length);
  }
  return all;
}

class Live {
  constructor(page) {
    this.page = page;
    this.growing = new GrowingTrace();
    this.revision = -1;
    this.ask();
  }
  say(text) {
    const state = byId("live-state");
    state.hidden = false;
    if (state.textContent !== text) state.textContent = text;
  }
  async ask() {
    let wait = 1000;
    try {
      const answer = await fetch(`report.json?revision=${this.revision}`, { cache: "no-store" });
      if (answer.status === 200) {
        const report = await answer.json();
        this.revision = report.revision;
        this.page.update(report);
      }
      const ticks = await (await fetch(`ticks.json?run=${encodeURIComponent(this.growing.id)}&from=${this.growing.received}`, { cache: "no-store" })).json();
      if (this.growing.take(ticks)) this.page.showGrowing(this.growing.trace, ticks.run);
      const { report } = this.page;
      if (ticks.run) wait = 250;
      this.say(report.status === "running" ? `live: ${report.counts.runs} of ${plural(report.expected, "run")}` : `${report.status}: ${plural(report.counts.runs, "run")}`);
    } catch {
      this.say("the program has ended; its results are in " + (this.page.report.folder_name || "its folder"));
      wait = 3000;
    }
    setTimeout(() => this.ask(), wait);
  }
}
