#pragma once

#include "experiments/tune/tune.hpp"

#include <map>

namespace solenoid {

/// The steps of a tuning run on disk, one line each, rewritten whole after each step: history.csv in its folder.
class TuneHistory {
 public:
  /// Reads what is there. `identity` stands for everything the scores depend on: ConfigError if the folder's history
  /// was written under another.
  TuneHistory(const std::string& folder, const std::vector<FreeParameter>& free, const SystemDescription& system,
              const std::string& identity);

  /// The score of these values, if an earlier run had it.
  const TuneStep* find(const std::vector<double>& values) const;
  void write(const std::vector<TuneStep>& steps) const;

 private:
  std::string path_, heading_;
  std::size_t score_columns_;
  std::map<std::vector<double>, TuneStep> known_;
};

}  // namespace solenoid
