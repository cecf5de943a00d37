#include "experiments/base/bounded_json.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <new>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// Counts while the parser reads, and stops it at a bound. Recursion begins later: with copies, printing, the end.
class JsonCounter {
 public:
  JsonCounter(const std::string& name, const std::string& allowed) : name_(name), allowed_(allowed) {}

  bool operator()(int depth, nlohmann::ordered_json::parse_event_t event, const nlohmann::ordered_json&) {
    using Event = nlohmann::ordered_json::parse_event_t;
    const bool begins = event == Event::object_start || event == Event::array_start;
    if (begins && depth >= json_bounds::depth) refuse(fmt::format("nested more than {} deep", json_bounds::depth));
    if (begins || event == Event::value) ++values_;
    if (values_ > json_bounds::values) refuse(fmt::format("more than {} values", json_bounds::values));
    const auto level = static_cast<std::size_t>(depth);
    if (event == Event::object_start) keys_[level + 1] = 0;
    if (event == Event::key) look_ups_ += keys_[level]++;
    if (look_ups_ > json_bounds::key_look_ups) refuse("an object of too many keys");
    return true;
  }

 private:
  [[noreturn]] void refuse(const std::string& problem) const {
    throw ConfigError(fmt::format("{}: {} (allowed: {})", name_, problem, allowed_));
  }

  const std::string &name_, &allowed_;
  int values_ = 0;
  long long look_ups_ = 0;
  std::array<long long, json_bounds::depth + 2> keys_{};
};

std::string where_in(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(text.size(), byte > 0 ? byte - 1 : 0));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t begin = before.rfind('\n');  // npos + 1 is 0
  return fmt::format("{}: not valid JSON at column {}", line, before.size() - (begin + 1) + 1);
}

}  // namespace

nlohmann::ordered_json parse_json(std::string_view text, const std::string& name, const std::string& allowed) {
  using Json = nlohmann::ordered_json;
  JsonCounter counter(name, allowed);
  try {
    return Json::parse(text, std::ref(counter));
  } catch (const Json::parse_error& error) {
    throw ConfigError(fmt::format("{}:{} (allowed: {})", name, where_in(text, error.byte), allowed));
  } catch (const Json::exception& error) {
    throw ConfigError(fmt::format("{}: not valid JSON: {} (allowed: {})", name, problem_with_json(error), allowed));
  } catch (const std::bad_alloc&) {
    throw ConfigError(fmt::format("{}: does not fit into memory (allowed: {})", name, allowed));
  }
}

std::string problem_with_json(const nlohmann::ordered_json::exception& error) {
  const std::string_view text = error.what();
  const std::size_t end = text.find("] ");
  return std::string(text.starts_with("[json.exception.") && end != std::string_view::npos ? text.substr(end + 2)
                                                                                           : text);
}

}  // namespace solenoid
