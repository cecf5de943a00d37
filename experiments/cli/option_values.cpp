#include "experiments/cli/option_values.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

template <class T>
bool is_number(const std::string& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

std::string refused(const std::string& text, const char* allowed) {
  return fmt::format("'{}' is refused (allowed: {})", text, allowed);
}

/// Decimal, whatever the command line's library reads: a zero in front does not make it octal.
template <class T>
std::string whole_number(std::string& text, const char* allowed) {
  T value = 0;
  if (!is_number(text, value)) return refused(text, allowed);
  text = fmt::format("{}", value);
  return {};
}

std::string finite_number(std::string& text) {
  double value = 0.0;
  return is_number(text, value) && std::isfinite(value) ? std::string() : refused(text, "a finite number");
}

void require_number(CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto first = [&](std::function<std::string(std::string&)> check) {
    option.transform(CLI::Validator(std::move(check), ""));  // in front of the option's own
  };
  if (type.starts_with("FLOAT")) first(finite_number);
  if (type.starts_with("UINT"))
    first([](std::string& text) { return whole_number<std::uint64_t>(text, "a whole number from 0"); });
  if (type.starts_with("INT"))
    first([](std::string& text) { return whole_number<std::int64_t>(text, "a whole number"); });
}

/// An empty name is a shell's variable that was not set, and none that is left out.
void require_text(CLI::Option& option) {
  option.transform(CLI::Validator(
      [](std::string& text) { return text.empty() ? refused(text, "what is not empty") : std::string(); }, ""));
}

}  // namespace

void require_values(CLI::App& app) {
  const bool hidden = app.get_group().empty();  // completes words, empty ones too
  for (CLI::Option* option : app.get_options()) {
    require_number(*option);
    if (!hidden && option->get_items_expected_max() > 0) require_text(*option);
  }
  for (CLI::App* command : app.get_subcommands({})) require_values(*command);
}

}  // namespace solenoid
