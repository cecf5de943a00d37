#include "core/config/reader.hpp"
#include "experiments/base/frames.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::HasSubstr;

TEST(FrameWindow, ReadsFramesByTheirOffsetsInAnyOrderWhateverItsSize) {
  const test::Folder folder;
  const std::string path = folder.file("frames");
  std::vector<std::pair<std::uint64_t, std::string>> frames;
  {
    FrameWriter writer(path);
    for (int i = 0; i < 200; ++i) {
      std::string content(static_cast<std::size_t>(i * 7 % 90), static_cast<char>('a' + i % 26));
      const std::uint64_t at = writer.append(content);
      frames.emplace_back(at, std::move(content));
    }
  }
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{13}, std::size_t{100}, std::size_t{1} << 18}) {
    FrameWindow window(path, bytes);
    for (const auto& [at, content] : frames) EXPECT_EQ(window.content(at), content) << bytes;
    for (std::size_t i = frames.size(); i-- > 0;) EXPECT_EQ(window.content(frames[i].first), frames[i].second) << bytes;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const auto& [at, content] = frames[i * 37 % frames.size()];
      EXPECT_EQ(window.content(at), content) << bytes;
    }
  }
}

TEST(FrameWindow, RefusesWhatIsNoWholeFrame) {
  const test::Folder folder;
  const std::string path = folder.file("frames");
  std::uint64_t second = 0;
  {
    FrameWriter writer(path);
    writer.append("first");
    second = writer.append("second");
  }
  const auto refused = [&](std::uint64_t at) {
    try {
      FrameWindow(path, 1000).content(at);
      return std::string("read");
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(refused(second), "read");
  EXPECT_THAT(refused(second + 1), HasSubstr("is damaged at byte"));
  EXPECT_THAT(refused(1'000'000), HasSubstr("is damaged at byte 1000000"));
  std::filesystem::resize_file(path, second + frame_overhead + 3);
  EXPECT_THAT(refused(second), HasSubstr("is damaged at byte"));
  EXPECT_EQ(refused(0), "read");
  std::filesystem::remove(path);
  EXPECT_THAT(refused(0), HasSubstr("cannot be read"));
}

}  // namespace
}  // namespace solenoid
