// The report as a browser shows it, and the live page. Needs node and Debian's chromium.

#include "experiments/base/child_process.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/report/live/live_server.hpp"
#include "experiments/report/merge.hpp"
#include "experiments/report/page.hpp"
#include "tests/experiments/needs_uplot.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/experiments/synthetic_runs.hpp"

#include <chrono>
#include <csignal>
#include <future>
#include <optional>
#include <regex>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid {
namespace {

using testing::HasSubstr;

bool has_program(const char* name) {
  return std::system(fmt::format("command -v {} >/dev/null 2>&1", name).c_str()) == 0;
}

#define NEEDS_A_BROWSER() \
  NEEDS_UPLOT();          \
  if (!has_program("chromium") || !has_program("node")) GTEST_SKIP() << "needs: apt-get install chromium nodejs"

/// Runs tests/experiments/report/report_page.mjs; what it prints, with its exit code behind.
std::string browse(const test::Folder& folder, const std::string& arguments) {
  const std::string command = fmt::format("cd '{}' && node '" SOLENOID_SOURCE_DIR
                                          "/tests/experiments/report/report_page.mjs' {} >.page 2>&1 </dev/null",
                                          folder.path(), arguments);
  const int status = std::system(command.c_str());
  return test::text_of(folder / ".page") + fmt::format("exit {}", status);
}

/// The program with arguments, under way, its standard error in a file.
class Background {
 public:
  Background(const test::Folder& folder, std::vector<std::string> arguments) : errors_(folder.file(".live")) {
    arguments.insert(arguments.begin(), SOLENOID_PROGRAM);
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    process_ = fork();
    if (process_ != 0) return;
    if (chdir(folder.path().c_str()) != 0 || !freopen(".live", "w", stderr) || !freopen(".live-out", "w", stdout))
      _exit(126);
    execv(SOLENOID_PROGRAM, argv.data());
    _exit(127);
  }
  ~Background() {
    if (process_ > 0) stop(SIGKILL);
  }
  /// Waits for a match in standard error; its first group.
  std::string wait_for(const std::string& pattern) const {
    for (int tries = 0; tries < 1200; ++tries) {
      std::smatch found;
      const std::string text = test::text_of(errors_);
      if (std::regex_search(text, found, std::regex(pattern))) return found[1];
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    ADD_FAILURE() << pattern << " never came: " << test::text_of(errors_);
    return {};
  }
  /// Itself and its children.
  std::vector<std::string> processes() const {
    std::vector<std::string> all = {std::to_string(process_)};
    std::ifstream children(fmt::format("/proc/{0}/task/{0}/children", process_));
    for (std::string child; children >> child;) all.push_back(child);
    return all;
  }
  /// Sends the signal; the exit code.
  int stop(int signal) {
    kill(process_, signal);
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
  }

 private:
  std::string errors_;
  pid_t process_ = -1;
};

/// An HTTP answer's status line, headers and body.
std::string fetch(const std::string& url, const std::string& path, const std::string& host = "") {
  const std::string port = url.substr(url.rfind(':') + 1);
  const std::string request = fmt::format("GET {} HTTP/1.1\\r\\nHost: {}\\r\\nConnection: close\\r\\n\\r\\n", path,
                                          host.empty() ? "127.0.0.1:" + port.substr(0, port.size() - 1) : host);
  const test::Folder folder;
  const std::string command =
      fmt::format("bash -c 'exec 3<>/dev/tcp/127.0.0.1/{}; printf \"{}\" >&3; cat <&3' >'{}' 2>/dev/null",
                  port.substr(0, port.size() - 1), request, folder.file("answer"));
  [[maybe_unused]] const int status = std::system(command.c_str());
  return test::text_of(folder / "answer");
}

/// Whether the process has a socket for datagrams of any net.
bool takes_datagrams(const std::string& process) {
  const std::string udp = test::text_of("/proc/net/udp") + test::text_of("/proc/net/udp6");
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/" + process + "/fd", ignored)) {
    const std::string link = std::filesystem::read_symlink(entry.path(), ignored).string();
    if (link.starts_with("socket:[") && udp.find(" " + link.substr(8, link.size() - 9) + " ") != std::string::npos)
      return true;
  }
  return false;
}

std::string body_of(const std::string& answer) { return answer.substr(answer.find("\r\n\r\n") + 4); }

TEST(ReportPage, SortsZoomsOverlaysAndPrintsFromDiskWithoutNetwork) {
  NEEDS_A_BROWSER();
  const test::Folder folder;
  folder.write("c.toml", std::string(test::small_campaign) + R"(
[[scenario]]
name = "long"
trajectory = { kind = "sine", periods = 24, lead_s = 0.5 }
)");
  ASSERT_EQ(test::run_program(folder, "compare c.toml --out r").exit_code, 0);
  const test::ProgramRun report = test::run_program(folder, "report r -o page.html");
  ASSERT_EQ(report.exit_code, 0) << report.err;
  EXPECT_THAT(browse(folder, "page.html"), testing::EndsWith("exit 0"));
}

TEST(ReportPage, KnowsAnotherSystemByItsDescription) {
  NEEDS_A_BROWSER();
  const test::Folder folder;
  ASSERT_EQ(test::run_program(folder, "compare inverter --scenario step --variant inverter_one_step --out r").exit_code,
            0);
  const test::ProgramRun report = test::run_program(folder, "report r -o page.html");
  ASSERT_EQ(report.exit_code, 0) << report.err;
  EXPECT_THAT(browse(folder, "page.html brief"), testing::EndsWith("exit 0"));
}

TEST(ReportPage, SaysWhatItListsOfMoreRunsThanItCanList) {
  NEEDS_A_BROWSER();
  const test::Folder folder;
  const Campaign campaign = test::synthetic_campaign({"thesis_pd", "nine_state", "thesis_cylinder"}, 600);
  test::write_synthetic(campaign, folder.file("r"), 4);
  merge(folder.file("r"), false);  // it has ended: only then are variants compared in pairs
  Results results = read_results(folder.file("r"), {.most = 100, .sample = 60});
  folder.write("page.html", report_of(results, true));
  EXPECT_THAT(browse(folder, "page.html large"), testing::EndsWith("exit 0"));
}

TEST(LivePage, FillsWhileACampaignWorksAndEndsWithCtrlC) {
  NEEDS_A_BROWSER();
  const test::Folder folder;
  folder.write("c.toml", test::small_campaign);
  Background compare(folder, {"compare", "c.toml", "--out", "r", "--live", "--jobs", "1"});
  const std::string url = compare.wait_for("live page at (http://127.0.0.1:[0-9]+/)");
  EXPECT_THAT(browse(folder, url + " live"), testing::EndsWith("exit 0"));
  compare.wait_for("(until Ctrl-C)");
  EXPECT_EQ(compare.stop(SIGINT), 0);
  EXPECT_EQ(fetch(url, "/"), "") << "the server has outlived the program";
}

TEST(LivePage, AnswersOnlyItsOwnNameAndItsOwnRuns) {
  NEEDS_UPLOT();
  const test::Folder folder;
  folder.write("c.toml", test::small_campaign);
  Background compare(folder, {"compare", "c.toml", "--out", "r", "--live"});
  const std::string url = compare.wait_for("live page at (http://127.0.0.1:[0-9]+/)");
  compare.wait_for("(until Ctrl-C)");
  std::this_thread::sleep_for(std::chrono::milliseconds(400));  // between two looks into the folder
  EXPECT_THAT(fetch(url, "/report.json", "elsewhere.example"), HasSubstr("403"));
  EXPECT_THAT(fetch(url, "/trace/..%2Fmanifest"), HasSubstr("404"));
  EXPECT_THAT(body_of(fetch(url, "/trace/step--nine_pd--s3")), testing::StartsWith("SLT2"));
  EXPECT_THAT(body_of(fetch(url, "/ticks.json")), HasSubstr(R"("run":"")"));
  const auto report = nlohmann::json::parse(body_of(fetch(url, "/report.json?revision=-1")));
  EXPECT_EQ(report.at("status"), "finished");
  EXPECT_EQ(report.at("runs").size(), report.at("expected").get<std::size_t>());
  EXPECT_EQ(report.at("live"), true);
  EXPECT_THAT(fetch(url, fmt::format("/report.json?revision={}", report.at("revision").get<int>())), HasSubstr("204"));
  const std::string port = url.substr(url.rfind(':') + 1, url.size() - url.rfind(':') - 2);
  const test::ProgramRun second = test::run_program(folder, "compare c.toml --out r2 --live --live-port " + port);
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_THAT(second.err, HasSubstr("--live-port: " + port));
  EXPECT_FALSE(std::filesystem::exists(folder / "r2"));
  EXPECT_EQ(compare.stop(SIGTERM), 0);
}

TEST(LivePage, GivesFilesOfItsRunsAndNothingElse) {
  NEEDS_UPLOT();
  const test::Folder folder;
  folder.write("c.toml", test::small_campaign);
  folder.write("secret", "secret");
  Background compare(folder, {"compare", "c.toml", "--out", "r", "--live"});
  const std::string url = compare.wait_for("live page at (http://127.0.0.1:[0-9]+/)");
  compare.wait_for("(until Ctrl-C)");
  for (const char* path : {"/../secret", "/trace/../../secret", "/trace/..%2f..%2fsecret", "/trace/%2e%2e/manifest",
                           "/manifest.json", "/runs/loaded--nine_pd--s3.json", "/trace/", "//"})
    EXPECT_THAT(fetch(url, path), testing::StartsWith("HTTP/1.1 404")) << path;
  EXPECT_THAT(fetch(url, "/", "evil.example"), testing::StartsWith("HTTP/1.1 403"));
  // The page's process looks at the folder now and then.
  EXPECT_TRUE(wait_until([&] { return fetch(url, "/trace/loaded--nine_pd--s3").starts_with("HTTP/1.1 200"); }, 10.0));
}

TEST(LivePage, ShowsARunInRealTimeAsItsTicksCome) {
  NEEDS_UPLOT();
  const test::Folder folder;
  Background run(folder, {"run", "thesis_pd", "--no-realtime", "--quiet", "--duration", "3", "--out", "r", "--live"});
  const std::string url = run.wait_for("live page at (http://127.0.0.1:[0-9]+/)");
  nlohmann::json ticks = nlohmann::json::object();
  for (int tries = 0; tries < 200 && ticks.value("run", "").empty(); ++tries) {
    ticks = nlohmann::json::parse(body_of(fetch(url, "/ticks.json?run=&from=0")), nullptr, false);
    if (!ticks.is_object()) ticks = nlohmann::json::object();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(ticks.at("run"), "cycloidal--thesis_pd--s1");
  for (const std::string& process : run.processes())
    EXPECT_FALSE(takes_datagrams(process)) << "anyone could send ticks";
  EXPECT_EQ(ticks.at("columns").at("position").size(), ticks.at("columns").at("tick").size());
  run.wait_for("(until Ctrl-C)");
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  const auto report = nlohmann::json::parse(body_of(fetch(url, "/report.json?revision=-1")));
  ASSERT_EQ(report.at("runs").size(), 1u);
  EXPECT_EQ(report["runs"][0].at("trace"), "served");
  EXPECT_THAT(body_of(fetch(url, "/trace/cycloidal--thesis_pd--s1")), testing::StartsWith("SLT2"));
  EXPECT_LE(run.stop(SIGINT), 1);  // 1: a shared machine that stood still sent it into SAFE
}

/// A page of a folder without results, served by the test itself.
struct ServedPage {
  test::Folder folder;
  std::optional<LiveServer> server{std::in_place, read_campaign("rig"), folder.file("r"), 0,
                                   LiveServer::Earlier::shown};
  std::vector<pid_t> processes = children_of(::getpid());
};

TEST(LivePage, IsNotStoppedFromTheTerminal) {
  NEEDS_UPLOT();
  const ServedPage page;
  ASSERT_EQ(page.processes.size(), 1u);
  const pid_t process = page.processes.front();
  ASSERT_EQ(::setpgid(process, process), 0);  // else nothing stops it where the tests have no terminal
  for (const int signal : {SIGTSTP, SIGTTIN, SIGTTOU}) ::kill(process, signal);
  ASSERT_FALSE(wait_until([&] { return ::waitpid(process, nullptr, WNOHANG | WUNTRACED) != 0; }, 0.5));
  EXPECT_THAT(fetch(page.server->url(), "/"), testing::StartsWith("HTTP/1.1 200"));
}

TEST(LivePage, EndsWithTheProgramThoughItWasStopped) {
  NEEDS_UPLOT();
  ServedPage page;
  ASSERT_EQ(page.processes.size(), 1u);
  const pid_t process = page.processes.front();
  ::kill(process, SIGSTOP);
  int status = 0;
  ASSERT_EQ(::waitpid(process, &status, WUNTRACED), process);
  ASSERT_TRUE(WIFSTOPPED(status));
  const auto ended = std::async(std::launch::async, [&] { page.server.reset(); });
  EXPECT_EQ(ended.wait_for(std::chrono::seconds(5)), std::future_status::ready);
  ::kill(process, SIGCONT);  // that the test ends
}

}  // namespace
}  // namespace solenoid
