#include "experiments/rig/log/json_numbers.hpp"

#include <limits>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

constexpr std::size_t deepest = 16;

/// What the parser calls. A method returns false to stop it.
class NumberHandler {
 public:
  explicit NumberHandler(const std::function<void(const std::string&, double)>& take) : take_(take) {}

  std::string problem;

  bool null() { return number(std::numeric_limits<double>::quiet_NaN()); }
  bool boolean(bool value) { return number(value ? 1.0 : 0.0); }
  bool number_integer(std::int64_t value) { return number(static_cast<double>(value)); }
  bool number_unsigned(std::uint64_t value) { return number(static_cast<double>(value)); }
  bool number_float(double value, const std::string&) { return number(value); }
  bool string(std::string&) { return levels_.empty() ? beside_object() : passed(); }
  bool binary(nlohmann::json::binary_t&) { return passed(); }
  bool start_object(std::size_t) { return opened(false); }
  bool start_array(std::size_t) { return opened(true); }
  bool end_object() { return closed(); }
  bool end_array() { return closed(); }
  bool key(std::string& name) {
    path_.resize(levels_.back().path_size);
    if (!path_.empty()) path_ += '.';
    path_ += name;
    return true;
  }
  bool parse_error(std::size_t byte, const std::string&, const nlohmann::detail::exception&) {
    problem = fmt::format("no JSON at its byte {}", byte);
    return false;
  }

 private:
  struct Level {
    std::size_t path_size;  // of what is around it
    bool list;
    std::size_t next = 0;  // place in the list
  };

  bool beside_object() {
    if (levels_.empty()) problem = "no JSON object";
    return false;
  }
  /// A list's elements have no key of their own.
  void name_element() {
    if (levels_.empty() || !levels_.back().list) return;
    path_.resize(levels_.back().path_size);
    path_ += fmt::format("{}{}", path_.empty() ? "" : ".", levels_.back().next++);
  }
  bool passed() {
    name_element();
    return problem.empty();
  }
  bool number(double value) {
    if (levels_.empty()) return beside_object();
    name_element();
    take_(path_, value);
    return true;
  }
  bool opened(bool list) {
    if (levels_.empty() && list) return beside_object();
    name_element();
    if (levels_.size() == deepest) problem = fmt::format("JSON nested more than {} deep", deepest);
    levels_.push_back({path_.size(), list});
    return problem.empty();
  }
  bool closed() {
    path_.resize(levels_.back().path_size);
    levels_.pop_back();
    return true;
  }

  const std::function<void(const std::string&, double)>& take_;
  std::vector<Level> levels_;
  std::string path_;
};

}  // namespace

std::optional<std::string> read_json_numbers(std::string_view json,
                                             const std::function<void(const std::string&, double)>& take) {
  NumberHandler handler(take);
  if (nlohmann::json::sax_parse(json, &handler)) return std::nullopt;
  return handler.problem.empty() ? "no JSON" : handler.problem;
}

}  // namespace solenoid
