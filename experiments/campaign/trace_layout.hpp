#pragma once

#include "core/system/description.hpp"

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace solenoid {

/// What of a system's runs is kept over time, and how people see it: reports, figures and live pages are drawn from this
/// alone.
struct TraceLayout {
  /// Where a tick's record has a signal.
  enum class Source {
    reference,   ///< the desired value of axis `index`
    state,       ///< true state `index`; where nobody knows it, measured channel `channel`
    mode,        ///< index of the applied pattern in the mode set, -1: a pattern without a name
    continuous,  ///< continuous input `index`, after the limits
  };
  /// A signal that is kept, every tick rounded to its resolution.
  struct Kept {
    std::string name, unit;
    double resolution = 1.0;
    Source source = Source::state;
    std::size_t index = 0, channel = 0;
  };
  /// A signal made of kept ones: constant + sum of factor x signal.
  struct Derived {
    std::string name, unit;
    double resolution = 1.0, constant = 0.0;
    std::vector<std::pair<std::string, double>> terms;
    bool operator==(const Derived&) const = default;
  };
  /// A line in a plot.
  struct Curve {
    std::string signal, label;
    bool desired = false;  ///< what another curve is to follow: thin and dashed
    bool operator==(const Curve&) const = default;
  };
  /// A plot over time.
  struct Panel {
    std::string label;   ///< "position"
    std::string unit{};  ///< in which people read it: "mm"; none of modes
    double scale = 1.0;  ///< of them in one of the signals' unit
    std::vector<Curve> curves{};
    bool modes = false;    ///< steps between named modes
    bool zero = false;     ///< the axis shows zero
    double limit = 0.0;    ///< the axis shows at least +- this [shown unit]; 0: as the values have it
    std::string choice{};  ///< panels of one choice share a place, one shown at a time; none: always shown
    bool operator==(const Panel&) const = default;
  };

  std::vector<Kept> kept;
  std::vector<Derived> derived;
  std::vector<Panel> panels;

  /// The resolution that a signal of a unit is kept with, if the system has no finer wish.
  static double usual_resolution(const std::string& unit);
};

/// The layout of a system with nothing but its description: its axes with their references in plots by unit, their
/// errors, the modes, each continuous input.
TraceLayout described_layout(const SystemDescription& system);

}  // namespace solenoid
