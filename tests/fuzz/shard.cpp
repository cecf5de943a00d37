// Runs as a results folder keeps them: frames, and what is in one.
#include "controllers/systems.hpp"
#include "experiments/campaign/shard_file.hpp"
#include "tests/fuzz/fuzz.hpp"

#include <stdexcept>

#include <nlohmann/json.hpp>

namespace {

using namespace solenoid;

WritingSession own_session() {
  const SystemDescription& system = systems().front()->description();
  WritingSession session{"maker", system.name, {}, {}, "host", 1, false};
  for (const Signal& condition : system.conditions) session.conditions.push_back(condition.key);
  for (const MetricColumn& metric : system.metrics) session.metrics.push_back(metric.key);
  return session;
}

void read_content(std::string_view content, WritingSession& session) {
  try {
    if (const auto text = session_frame(content)) session = decode_session(*text);
    if (const auto frame = run_frame(content)) {
      decode_head(frame->run);
      to_json(decode_run(frame->run, session).record);
    }
  } catch (const std::invalid_argument&) {
    // refused
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string text(fuzz::text_of(bytes, size));
  WritingSession session = own_session();
  read_content(text, session);  // past the checksums
  const fuzz::MemoryFile file(text);
  FrameReader frames(file.path());
  while (frames.next()) read_content(frames.content(), session);
  return 0;
}
