#pragma once

#include "experiments/campaign/stored_runs.hpp"

#include <functional>
#include <string_view>

#include <nlohmann/json.hpp>

namespace solenoid {

/// Takes some text after what it took before.
using TextSink = std::function<void(std::string_view text)>;

/// All runs that a folder keeps, one after the other, so that a million of them need no memory: to_csv() of their
/// records, if there are any. Runs whose record cannot be read any more are left out.
void write_csv(const StoredRuns& runs, const SystemDescription& system, const TextSink& write);

/// The same as the text of `{"runs": [...]}` that Result::json() makes, with the members of the object `more` behind.
void write_json(const StoredRuns& runs, const nlohmann::ordered_json& more, const TextSink& write);

}  // namespace solenoid
