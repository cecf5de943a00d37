#include "experiments/base/frames.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <random>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::ElementsAreArray;
using testing::HasSubstr;

/// What a reader finds in a file.
struct Found {
  std::vector<std::string> contents;
  std::vector<std::uint64_t> offsets;
  std::uint64_t damaged = 0, rest = 0;
};

Found found_in(const std::string& path) {
  Found found;
  FrameReader frames(path);
  while (frames.next()) {
    found.contents.emplace_back(frames.content());
    found.offsets.push_back(frames.offset());
    EXPECT_EQ(read_frame(path, frames.offset()), frames.content());
  }
  found.damaged = frames.damaged();
  found.rest = frames.rest();
  return found;
}

/// A file of frames of many lengths, some of which look like frames themselves.
class Frames : public testing::Test {
 protected:
  Frames() : path_(folder_.file("f")) {
    std::mt19937_64 random(1);
    FrameWriter writer(path_);
    for (const std::size_t length : {0u, 1u, 5u, 300u, 12u, 70u}) {
      std::string content(length, '\0');
      for (char& c : content) c = static_cast<char>(random());
      contents_.push_back(content);
    }
    contents_.push_back("SLF1");
    contents_.push_back(std::string("SLF1\xff\xff\xff\xff", 8) + "SLF1SLF1");
    for (const std::string& content : contents_) {
      ends_.push_back(writer.append(content) + frame_overhead + content.size());
      EXPECT_EQ(writer.bytes(), ends_.back());
    }
    bytes_ = test::text_of(path_);
  }

  std::vector<std::string> first(std::size_t count) const {
    return {contents_.begin(), contents_.begin() + static_cast<std::ptrdiff_t>(count)};
  }

  test::Folder folder_;
  std::string path_, bytes_;
  std::vector<std::string> contents_;
  std::vector<std::uint64_t> ends_;
};

TEST_F(Frames, AreReadAsTheyWereWritten) {
  const Found found = found_in(path_);
  EXPECT_THAT(found.contents, ElementsAreArray(contents_));
  EXPECT_EQ(found.damaged, 0u);
  EXPECT_EQ(found.rest, 0u);
}

TEST_F(Frames, CutAtAnyByteTheWholeOnesAreThereAndTheFileGrowsOn) {
  for (std::size_t cut = 0; cut < bytes_.size(); ++cut) {
    folder_.write("cut", "");
    std::ofstream(folder_.file("cut"), std::ios::binary) << bytes_.substr(0, cut);
    const auto whole = static_cast<std::size_t>(std::ranges::count_if(ends_, [&](auto end) { return end <= cut; }));
    const Found found = found_in(folder_.file("cut"));
    ASSERT_THAT(found.contents, ElementsAreArray(first(whole))) << cut;
    ASSERT_EQ(found.rest, cut - (whole > 0 ? ends_[whole - 1] : 0)) << cut;
    FrameWriter(folder_.file("cut")).append("more");
    std::vector<std::string> expected = first(whole);
    expected.emplace_back("more");
    const Found after = found_in(folder_.file("cut"));
    ASSERT_THAT(after.contents, ElementsAreArray(expected)) << cut;
    ASSERT_EQ(after.damaged + after.rest, 0u) << cut;
  }
}

TEST_F(Frames, AChangedByteCostsItsOwnFrameAlone) {
  for (std::size_t at = 0; at < bytes_.size(); ++at)
    for (const int change : {0x01, 0x80}) {
      std::string changed = bytes_;
      changed[at] = static_cast<char>(changed[at] ^ change);
      std::ofstream(folder_.file("changed"), std::ios::binary) << changed;
      std::vector<std::string> expected = contents_;
      expected.erase(expected.begin() + std::ranges::count_if(ends_, [&](auto end) { return end <= at; }));
      const Found found = found_in(folder_.file("changed"));
      ASSERT_THAT(found.contents, ElementsAreArray(expected)) << at;
      ASSERT_GT(found.damaged + found.rest, 0u) << at;
    }
}

TEST_F(Frames, RubbishInFrontBetweenAndBehindIsSkipped) {
  const std::string rubbish(1000, 'S');
  std::ofstream(folder_.file("r"), std::ios::binary)
      << rubbish << bytes_.substr(0, ends_[2]) << "SLF1 and more" << bytes_.substr(ends_[2]) << rubbish;
  const Found found = found_in(folder_.file("r"));
  EXPECT_THAT(found.contents, ElementsAreArray(contents_));
  EXPECT_EQ(found.damaged, rubbish.size() + 13);
  EXPECT_EQ(found.rest, rubbish.size());
}

TEST_F(Frames, AReaderGoesOnWhereItWas) {
  FrameWriter writer(path_);
  FrameReader frames(path_, ends_.back());
  EXPECT_FALSE(frames.next());
  writer.append("later");
  FrameReader again(path_, frames.end());
  ASSERT_TRUE(again.next());
  EXPECT_EQ(again.content(), "later");
}

TEST_F(Frames, OneProcessWrites) {
  const FrameWriter writer(path_);
  try {
    const FrameWriter other(path_);
    FAIL();
  } catch (const OutputError& error) {
    EXPECT_EQ(std::string(error.what()), path_ + ": in use by another solenoid");
  }
}

TEST_F(Frames, WhatIsNoFileIsRefusedByName) {
  for (const auto& [name, why] :
       std::map<std::string, std::string>{{"nothing", "No such file"}, {"", "regular file"}}) {
    try {
      FrameReader reader(folder_.file(name));
      FAIL() << name;
    } catch (const ConfigError& error) {
      EXPECT_THAT(error.what(), HasSubstr(why));
    }
  }
  EXPECT_THROW(read_frame(path_, 1), ConfigError);
  EXPECT_THROW(read_frame(path_, bytes_.size()), ConfigError);
  EXPECT_THROW(read_frame(path_, 1'000'000), ConfigError);
}

}  // namespace
}  // namespace solenoid
