#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// The text of a file that was shipped inside the program, by its path below experiments/systems/NAME/data/, e.g.
/// "tables/table_5-2_step_np.csv" or "scenarios/variants.toml", or "report/assets/page.html"; empty if there is none of
/// that name.
std::string_view embedded_text(std::string_view name);

/// The names that embedded_text knows: those of the program, sorted, then those embedded since.
const std::vector<std::string>& embedded_names();

/// Adds a text, as a plug-in ships it. Throws ConfigError where there is one of its name.
void embed_text(const std::string& name, std::string text);

}  // namespace solenoid
