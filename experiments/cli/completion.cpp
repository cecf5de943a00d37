#include "experiments/cli/completion.hpp"

#include "experiments/cli/command_tree.hpp"
#include "experiments/cli/value_kinds.hpp"

#include <algorithm>

#include <CLI/CLI.hpp>

namespace solenoid {
namespace {

/// Where a command line stands after some words.
struct Position {
  const CLI::App* command = nullptr;
  const CLI::Option* option = nullptr;  ///< takes the next word as its value
  bool value_open = false;              ///< and has none yet: the next word can be nothing else
  std::size_t positionals = 0;          ///< words that were no option's
  bool options_over = false;            ///< after "--"
  std::string campaign = {};            ///< the one that was named

  void take(const std::string& word);
  void take_option(const std::string& word);
  void take_value(const CLI::Option* taker, const std::string& value);
  const CLI::Option* next_positional() const;
};

const CLI::Option* option_named(const CLI::App& command, const std::string& name) {
  for (const CLI::Option* option : options_of(command))
    if (option->check_name(name)) return option;
  return nullptr;
}

const CLI::App* command_named(const CLI::App& command, const std::string& name) {
  for (const CLI::App* inner : commands_of(command))
    if (inner->get_name() == name) return inner;
  return nullptr;
}

bool is_option(const std::string& word) { return word.size() > 1 && word[0] == '-'; }

/// What follows may depend on it: names are those of a campaign.
void Position::take_value(const CLI::Option* taker, const std::string& value) {
  if (taker && kind_of(*taker).starts_with(value_kind::campaign)) campaign = value;
}

void Position::take_option(const std::string& word) {
  const std::size_t equals = word.find('=');
  option = option_named(*command, word.substr(0, equals));
  if (option && !takes_value(*option)) option = nullptr;
  value_open = option && equals == std::string::npos;
  if (option && !value_open) take_value(option, word.substr(equals + 1));
  if (option && !value_open && !takes_several(*option)) option = nullptr;
}

void Position::take(const std::string& word) {
  if (value_open) {
    take_value(option, word);
    value_open = false;
    if (!takes_several(*option)) option = nullptr;
  } else if (word == "--") {
    options_over = true;
    option = nullptr;
  } else if (!options_over && is_option(word)) {
    take_option(word);
  } else if (option) {
    // One value more of an option that takes several.
  } else if (const CLI::App* inner = command_named(*command, word); inner && positionals == 0) {
    command = inner;
  } else {
    take_value(next_positional(), word);
    ++positionals;
  }
}

/// The positional that the next word is; the last one may take them all.
const CLI::Option* Position::next_positional() const {
  const std::vector<const CLI::Option*> all = positionals_of(*command);
  if (positionals < all.size()) return all[positionals];
  return !all.empty() && takes_several(*all.back()) ? all.back() : nullptr;
}

class Candidates {
 public:
  Candidates(std::string begun, std::string campaign) : begun_(std::move(begun)), campaign_(std::move(campaign)) {}

  void add(const std::string& word) {
    if (word.starts_with(begun_)) found_.push_back(word);
  }

  /// Values of the option; in a list of them, of its last part.
  void add_values(const CLI::Option& option) {
    const std::size_t cut = option.get_delimiter() != '\0' ? begun_.rfind(option.get_delimiter()) : std::string::npos;
    const std::string before = cut == std::string::npos ? "" : begun_.substr(0, cut + 1);
    for (const std::string& value : allowed_values(option)) add(before + value);
    const ValueChoice choice = value_choice(kind_of(option), campaign_);
    for (const std::string& name : choice.names) add(before + name);
    for (const std::string& ending : choice.endings) found_.push_back(":files " + ending);
    if (choice.folders) found_.push_back(":folders");
  }

  void add_options(const CLI::App& command) {
    for (const CLI::Option* option : options_of(command)) {
      if (option->get_lnames().empty()) add("-" + option->get_snames().front());
      for (const std::string& name : option->get_lnames()) add("--" + name);
    }
  }

  std::vector<std::string> found() const { return found_; }

 private:
  std::string begun_, campaign_;
  std::vector<std::string> found_;
};

std::vector<std::string> after_equals(const Position& at, const std::string& word, std::size_t equals) {
  Candidates candidates(word.substr(equals + 1), at.campaign);
  const CLI::Option* option = option_named(*at.command, word.substr(0, equals));
  if (option && takes_value(*option)) candidates.add_values(*option);
  return candidates.found();
}

}  // namespace

std::vector<std::string> completions(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty()) return {};
  Position at{.command = &app};
  for (std::size_t i = 0; i + 1 < words.size(); ++i) at.take(words[i]);
  const std::string& begun = words.back();
  Candidates candidates(begun, at.campaign);
  const bool option_begun = !at.value_open && !at.options_over && begun.starts_with('-');
  if (const std::size_t equals = begun.find('='); option_begun && equals != std::string::npos)
    return after_equals(at, begun, equals);
  if (option_begun) {
    candidates.add_options(*at.command);
    return candidates.found();
  }
  if (at.option) candidates.add_values(*at.option);
  if (at.value_open) return candidates.found();
  const CLI::Option* positional = at.next_positional();
  if (positional && !at.option) candidates.add_values(*positional);
  const std::vector<const CLI::App*> commands = at.positionals == 0 ? commands_of(*at.command) : decltype(commands){};
  for (const CLI::App* command : commands) candidates.add(command->get_name());
  if (!positional && !at.option && commands.empty() && !at.options_over) candidates.add_options(*at.command);
  return candidates.found();
}

}  // namespace solenoid
