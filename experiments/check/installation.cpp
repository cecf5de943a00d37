#include "experiments/base/build_info.hpp"
#include "experiments/base/child_process.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/check/checks.hpp"
#include "experiments/rig/comedi_io.hpp"
#include "solvers/minlp/bonmin.hpp"

#include <cstdio>
#include <filesystem>
#include <map>
#include <sstream>

#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <IpoptConfig.h>
#include <amd.h>
#include <boost/version.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <nlopt.h>
#include <spdlog/version.h>
#include <sys/wait.h>

namespace solenoid {
namespace {

/// Versions of the named Debian packages that are installed; empty where there is no dpkg.
std::map<std::string, std::string> debian_versions(const std::vector<std::string>& packages) {
  std::string command = "dpkg-query -W -f='${db:Status-Status} ${Package} ${Version}\\n'";
  for (const std::string& package : packages) command += " " + package;
  std::map<std::string, std::string> versions;
  FILE* pipe = ::popen((command + " 2>/dev/null").c_str(), "r");
  if (!pipe) return versions;
  char line[512];
  while (std::fgets(line, sizeof line, pipe)) {
    std::istringstream words(line);
    std::string status, package, version;
    if (words >> status >> package >> version && status == "installed") versions[package] = version;
  }
  ::pclose(pipe);
  return versions;
}

Check optional_program(const char* name, const char* package, const char* use) {
  const std::string path = program_on_path(name);
  if (path.empty()) return {"optional", name, "missing", fmt::format("{}: apt-get install {}", use, package)};
  return {"optional", name, "ok", fmt::format("{} ({})", path, use)};
}

Check optional_library(const char* name, const char* package, const char* use,
                       const std::map<std::string, std::string>& versions) {
  const auto found = versions.find(package);
  if (found == versions.end())
    return {"optional", name, "missing", fmt::format("{}: apt-get install {}", use, package)};
  return {"optional", name, "ok", fmt::format("{} ({})", found->second, use)};
}

/// Solvers that are linked: there whatever packages this machine has.
std::vector<Check> linked_solvers() {
  int major = 0, minor = 0, bugfix = 0;
  nlopt_version(&major, &minor, &bugfix);
  const Check bonmin = minlp::available() ? Check{"built with", "Bonmin", "ok", "mixed-integer reference solver"}
                                          : Check{"optional", "Bonmin", "missing",
                                                  "mixed-integer reference solver: apt-get install "
                                                  "coinor-libbonmin-dev, build afresh"};
  return {{"built with", "Boost", "ok",
           fmt::format("{}.{} (the truth plant)", BOOST_VERSION / 100000, BOOST_VERSION / 100 % 1000)},
          {"built with", "Ipopt", "ok", IPOPT_VERSION " (nonlinear reference solver)"},
          {"built with", "NLopt", "ok", fmt::format("{}.{}.{} (tuning)", major, minor, bugfix)},
          bonmin};
}

}  // namespace

std::vector<Check> check_installation() {
  const BuildInfo build = build_info();
  const auto library = [](const char* name, std::string version) {
    return Check{"built with", name, "ok", std::move(version)};
  };
  std::vector<Check> checks = {
      {"program", "solenoid", "ok",
       fmt::format("{}, revision {}, {}, {}", build.version,
                   build.git_revision.empty() ? "unknown" : build.git_revision, build.compiler, build.build_type)},
      library("Eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)),
      library("SuiteSparse AMD", fmt::format("{}.{}.{}", AMD_MAIN_VERSION, AMD_SUB_VERSION, AMD_SUBSUB_VERSION)),
      library("fmt", fmt::format("{}.{}.{}", FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100)),
      library("spdlog", fmt::format("{}.{}.{}", SPDLOG_VER_MAJOR, SPDLOG_VER_MINOR, SPDLOG_VER_PATCH)),
      library("CLI11", CLI11_VERSION),
      library("nlohmann/json", fmt::format("{}.{}.{}", NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR,
                                           NLOHMANN_JSON_VERSION_PATCH))};
  const auto versions =
      debian_versions({"libtomlplusplus-dev", "libxsimd-dev", "pybind11-dev", "python3-numpy", "python3-sympy"});
  for (const auto& [name, package] : {std::pair{"toml++", "libtomlplusplus-dev"}, {"xsimd", "libxsimd-dev"}})
    if (const auto found = versions.find(package); found != versions.end())
      checks.push_back(library(name, found->second));
  for (Check& linked : linked_solvers()) checks.push_back(std::move(linked));
  checks.push_back(optional_program("gnuplot", "gnuplot-nox", "figures"));
  checks.push_back(optional_library("pybind11", "pybind11-dev", "building the Python package", versions));
  checks.push_back(optional_library("NumPy", "python3-numpy", "the Python package", versions));
  checks.push_back(optional_library("SymPy", "python3-sympy", "models in Python", versions));
  const ComediSupport comedi = comedi_support();
  checks.push_back({"optional", "comedi driver", comedi.built && comedi.library ? "ok" : "missing", comedi.detail});
  checks.push_back(optional_program("python3", "python3", "tests of the script and logs"));
  const bool uplot = !embedded_text("uplot/uPlot.iife.min.js").empty();
  checks.push_back({"optional", "uPlot", uplot ? "ok" : "missing",
                    uplot ? "built in (curves of reports)"
                          : "curves of reports: apt-get install npm, npm ci in the project's folder, build again"});
  checks.push_back(optional_program("arm-none-eabi-g++", "gcc-arm-none-eabi libstdc++-arm-none-eabi-dev libnewlib-dev",
                                    "the firmware of the rig's node"));
  checks.push_back(optional_program("qemu-system-arm", "qemu-system-arm", "the firmware's image without a board"));
  checks.push_back(optional_program("sbatch", "slurm-client", "campaigns on a cluster"));
  checks.push_back(optional_program("node", "nodejs", "tests of the report and logs"));
  checks.push_back(optional_program("npm", "npm", "uPlot for reports"));
  checks.push_back(optional_program("chromium", "chromium", "testing the report"));
  return checks;
}

}  // namespace solenoid
