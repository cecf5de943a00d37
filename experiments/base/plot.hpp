#pragma once

#include <string>
#include <vector>

namespace solenoid {

enum class FigureFormat { svg, png };

/// A figure: panels with curves, drawn by gnuplot in the colours and lines that all figures have.
struct Plot {
  /// `what`: "using 1:2 with lines lw 2 lc rgb '#1f77b4'" of the panel's data, or "index 1 using ..." of one of its
  /// blocks; or an expression of x, "5000 with lines". Without a title it is not in the key.
  struct Curve {
    std::string what, title = {};
  };
  struct Panel {
    std::string settings;  ///< lines of gnuplot before it is drawn: "set xlabel 'time, s'\n"
    std::string data;      ///< lines of numbers; two empty lines between blocks
    std::vector<Curve> curves;
  };

  int width = 1000, height = 420;  ///< pixels
  std::string title = {};
  /// Of several panels: "ROWS,COLUMNS", and what `set multiplot` takes after that.
  std::string layout = {};
  std::string settings = {};  ///< for all panels
  std::vector<Panel> panels = {};
};

/// Colours of lines, told apart by everybody; the n-th of a figure's.
const char* plot_colour(std::size_t n);

/// Draws into `path`, whole or not at all. Throws what draw_with_gnuplot does.
void draw(const Plot& plot, const std::string& path, FigureFormat format = FigureFormat::svg);

}  // namespace solenoid
