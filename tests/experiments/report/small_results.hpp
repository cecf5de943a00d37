#pragma once

#include "tests/experiments/program_under_test.hpp"
#include "tests/experiments/report/older_folder.hpp"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid::test {

/// The data of a page, as its script reads them.
inline nlohmann::ordered_json data_of(const std::string& html) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t from = html.find(begin) + begin.size();
  return nlohmann::ordered_json::parse(html.substr(from, html.find("</script>", from) - from));
}

/// The small campaign's results, made once.
inline const Folder& small_results() {
  static const Folder folder;
  static const int exit_code = [] {
    folder.write("c.toml", small_campaign);
    const ProgramRun run = run_program(folder, "compare c.toml --out results --format json");
    folder.write("results.json", run.out);
    return run.exit_code;
  }();
  EXPECT_EQ(exit_code, 0);
  return folder;
}

/// The same as the version before would have left them, a file a run.
inline const Folder& older_results() {
  static const Folder folder;
  static const bool made = [] {
    std::filesystem::copy(small_results().file("results"), folder.file("results"),
                          std::filesystem::copy_options::recursive);
    make_older(folder.file("results"));
    return true;
  }();
  EXPECT_TRUE(made);
  return folder;
}

/// The small campaign's results, a fresh copy of them in "r".
inline void copy_results(const Folder& folder, const Folder& from = small_results()) {
  std::filesystem::remove_all(folder.file("r"));
  std::filesystem::copy(from.file("results"), folder.file("r"), std::filesystem::copy_options::recursive);
}

}  // namespace solenoid::test
