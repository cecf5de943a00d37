#pragma once

namespace CLI {
class App;
}

namespace solenoid {

/// Has every option of a command and of those below it refuse an empty value, and every numeric one what is no number:
/// NaN, infinity, what overflows, a sign where none may be, trailing characters. Ranges, which NaN passes, are the
/// options' own and are looked at after.
void require_values(CLI::App& app);

}  // namespace solenoid
