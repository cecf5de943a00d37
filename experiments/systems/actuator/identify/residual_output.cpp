#include "core/config/document.hpp"
#include "experiments/systems/actuator/identify/residual.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

std::string numbers(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(fmt::format("{:.6g}", value + 0.0));  // no -0
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

std::string velocity_text(const HatSum& hats) {
  return fmt::format("\n[velocity]\nknots_m_s = {}\nforce_n = {}\n",
                     numbers({hats.knots().begin(), hats.knots().end()}),
                     numbers({hats.values().begin(), hats.values().end()}));
}

/// A key whose text may hold anything, as the names of files do.
std::string text_key(const char* key, const std::string& text) { return toml_text(toml::table{{key, text}}) + "\n"; }

std::string sigma_text(const char* name, const ResidualShare& share) {
  std::vector<double> sigma;
  for (const GpValue& value : share.found) sigma.push_back(std::sqrt(value.variance));
  return fmt::format("{0}_kernel = {{ sigma_n = {1:.6g}, length = {2:.6g} }}\n{0}_sigma_n = {3}\n{0}_trust = {4}\n",
                     name, share.kernel.sigma, share.kernel.length, numbers(sigma), numbers(share.trust));
}

/// Lines of "x low high mean" over the knots of one share. Where nothing is known the band has a gap: one empty line
/// however many such knots there are, for two would begin gnuplot's next index.
std::string band(const ResidualShare& share) {
  std::string text;
  bool gap = false;
  for (std::size_t i = 0; i < share.knots.size(); ++i) {
    const double half = 1.96 * std::sqrt(share.found[i].variance), mean = share.found[i].mean;
    if (share.trust[i] == 0.0) {
      gap = !text.empty();
      continue;
    }
    if (std::exchange(gap, false)) text += "\n";
    text += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g}\n", share.knots[i], mean - half, mean + half, mean);
  }
  return text;
}

std::string held_out_text(const HeldOutForce& held) {
  return fmt::format("held_out_samples = {}\nheld_out_rms_n = {}  # without and with it\nheld_out_inside_95 = {:.4g}\n",
                     held.samples, numbers({held.without_n, held.with_n}), held.inside_95);
}

}  // namespace

std::string residual_file(const ResidualFinding& found, const ResidualSource& source) {
  std::string text =
      "# A force that a model leaves out, by `solenoid identify residual`; which model, and from what, is below.\n"
      "# A variant takes it as residual = \"THIS FILE\".\n";
  text += velocity_text(found.velocity.hats);
  text += "\n[identified]\n";
  text += text_key("logs", source.logs) + text_key("data", source.hash) + text_key("model_of", source.believes);
  text += fmt::format("samples = {}\n", found.samples);
  std::vector<double> payload, payload_sigma;
  for (const GpValue& value : found.payload_kg) {
    payload.push_back(value.mean);
    payload_sigma.push_back(std::sqrt(value.variance));
  }
  text += fmt::format("velocity_m_s = {}\nposition_m = {}\npayload_kg = {}\npayload_sigma_kg = {}\n",
                      numbers({found.velocity_range_m_s[0], found.velocity_range_m_s[1]}),
                      numbers({found.position_range_m[0], found.position_range_m[1]}), numbers(payload),
                      numbers(payload_sigma));
  text += fmt::format("noise_n = {:.6g}\n", found.noise_n) + sigma_text("velocity", found.velocity);
  text += fmt::format("log_likelihood = {:.6g}\nlog_likelihood_of_noise_alone = {:.6g}\n", found.log_likelihood,
                      found.without_residual);
  return found.held_out ? text + held_out_text(*found.held_out) : text;
}

Plot residual_plot(const ResidualFinding& found) {
  std::string data;
  for (const ResidualSample& s : found.drawn) data += fmt::format("{:.6g} {:.6g}\n", s.velocity_m_s, s.force_n);
  data += "\n\n" + band(found.velocity) + "\n\n";
  const HatSum& hats = found.velocity.hats;
  for (std::size_t i = 0; i < hats.knots().size(); ++i)
    data += fmt::format("{:.6g} {:.6g}\n", hats.knots()[i], hats.values()[i]);
  const auto at = [](double v) { return fmt::format("{:.6g}", v); };
  return {.width = 900,
          .height = 460,
          .title = "Force that the model leaves out",
          .panels = {
              {"set xlabel 'velocity, m/s'\nset ylabel 'force, N'\nset key top right\n"
               "set arrow 1 from " +
                   at(found.velocity_range_m_s[0]) + ", graph 0 to " + at(found.velocity_range_m_s[0]) +
                   ", graph 1 nohead dt 2 lc rgb '#909090'\n" + "set arrow 2 from " + at(found.velocity_range_m_s[1]) +
                   ", graph 0 to " + at(found.velocity_range_m_s[1]) + ", graph 1 nohead dt 2 lc rgb '#909090'\n",
               data,
               {{"index 1 using 1:2:3 with filledcurves fs solid 0.25 noborder lc rgb '#d62728'", "95 % band"},
                {"index 0 using 1:2 with points pt 7 ps 0.3 lc rgb '#1f77b4'", "samples, payload taken out"},
                {"index 1 using 1:4 with lines lw 1.2 lc rgb '#d62728'", "mean"},
                {"index 2 using 1:2 with lines lw 2 lc rgb '#2ca02c'", "in predictions; dashed: ends of the data"}}}}};
}

}  // namespace solenoid
