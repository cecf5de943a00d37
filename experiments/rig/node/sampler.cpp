#include "experiments/rig/node/sampler.hpp"

#include <algorithm>

namespace solenoid {

Sampler::Sampler(const SamplerSettings& settings, std::size_t channels) noexcept
    : conversions_(std::clamp<std::uint32_t>(settings.conversions, 1, most_conversions)),
      spacing_us_(std::max<std::uint32_t>(1, settings.period_us / conversions_)),
      channels_(std::min(channels, most_node_channels)) {}

void Sampler::poll(NodeHardware& board, std::uint64_t now_us) noexcept {
  if (now_us < due_us()) return;
  const bool kept_up = now_us - due_us_ < spacing_us_;  // else the raster begins anew
  due_us_ = (kept_up ? due_us_ : now_us) + spacing_us_;
  convert(board, now_us);
}

void Sampler::convert(NodeHardware& board, std::uint64_t now_us) noexcept {
  newest_ = newest_ + 1 >= conversions_ ? 0 : newest_ + 1;
  board.convert(std::span(counts_[newest_]).first(channels_));
  times_us_[newest_] = now_us;
  taken_ = std::min(taken_ + 1, conversions_);
}

Sampler::Sample Sampler::newest(NodeHardware& board, std::uint64_t now_us) noexcept {
  if (taken_ == 0 || conversions_ == 1) convert(board, now_us);
  const std::uint64_t longest_us = 3 * std::uint64_t{spacing_us_} * conversions_ / 2;
  Sample sample;
  sample.conversions = 0;
  std::uint64_t before_us = 0;  // the newest, summed up
  for (std::uint32_t at = newest_; sample.conversions < taken_; at = (at == 0 ? conversions_ : at) - 1) {
    if (times_us_[newest_] - times_us_[at] > longest_us) break;
    before_us += times_us_[newest_] - times_us_[at];
    ++sample.conversions;
    for (std::size_t c = 0; c < channels_; ++c) sample.sums[c] += counts_[at][c];
  }
  sample.time_us = times_us_[newest_] - before_us / sample.conversions;
  return sample;
}

std::int32_t NodeInput::microvolts(std::int64_t sum_of_counts, std::uint32_t conversions) const noexcept {
  const std::int64_t divisor = std::int64_t{conversions} << 16, scaled = sum_of_counts * scale;
  return static_cast<std::int32_t>(offset_microvolts + (scaled + (scaled < 0 ? -divisor : divisor) / 2) / divisor);
}

}  // namespace solenoid
