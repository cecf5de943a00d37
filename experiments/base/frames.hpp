#pragma once

#include "experiments/base/files.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace solenoid {

/// A file that only grows, of frames each of which is as it was written, or not there:
///
///   "SLF1", bytes of the content [4], CRC-32 of these four and the content [4], content
///
/// numbers little endian. What was cut off, overwritten or never finished is skipped, up to the next frame that is whole.
inline constexpr std::size_t frame_overhead = 12, most_content = 64'000'000;

/// Another process has the file.
class FileInUse : public OutputError {
 public:
  using OutputError::OutputError;
};

/// Appends frames. The file is this object's alone: another process that opens it is refused, where the file system
/// knows of locks.
class FrameWriter {
 public:
  /// Opens the file, or makes it, and takes off an end that is no whole frame. Throws FileInUse, OutputError.
  explicit FrameWriter(std::string path);

  /// Appends a frame; where it begins. After a failure, a full disk, the file ends with the frame before. Throws
  /// OutputError.
  std::uint64_t append(std::string_view content);
  /// Has the disk keep what was appended. Throws OutputError.
  void sync();
  const std::string& path() const { return path_; }
  /// Of the file.
  std::uint64_t bytes() const { return end_; }

 private:
  [[noreturn]] void refuse(int error) const;

  std::string path_;
  OpenFile file_;
  std::uint64_t end_ = 0;
};

/// Reads a file's frames in order, which may be growing meanwhile.
class FrameReader {
 public:
  /// Throws ConfigError if the file cannot be read.
  explicit FrameReader(std::string path, std::uint64_t from = 0);
  FrameReader(const FrameReader&) = delete;
  FrameReader& operator=(const FrameReader&) = delete;

  /// The next whole frame; false at the end of those there are.
  bool next();
  std::uint64_t offset() const { return offset_; }       ///< of that frame
  std::string_view content() const { return content_; }  ///< until the next call
  std::uint64_t end() const { return end_; }             ///< behind it: where to go on when the file has grown
  /// Bytes before end() that are of no whole frame.
  std::uint64_t damaged() const { return damaged_; }
  /// Bytes behind end(): of a frame that was cut off, or is being written. Known when next() was false.
  std::uint64_t rest() const { return size_ - end_; }

 private:
  bool fill(std::size_t bytes);

  std::string path_, buffer_;
  OpenFile file_;
  std::uint64_t size_ = 0, begin_ = 0;  ///< of the file; of the buffer in it
  std::uint64_t offset_ = 0, end_ = 0, damaged_ = 0;
  std::string_view content_;
};

/// Reads a file's frames by their offsets, which mostly follow one another: so much of the file is in memory, and no
/// open file, so that a process may have one of each of very many files.
class FrameWindow {
 public:
  FrameWindow(std::string path, std::size_t bytes) : path_(std::move(path)), bytes_(bytes) {}

  /// The content of the frame at an offset, until the next call. Throws ConfigError naming the file if there is no whole
  /// one.
  std::string_view content(std::uint64_t offset);

 private:
  std::string_view have(std::uint64_t offset, std::size_t count);

  std::string path_, buffer_;
  std::size_t bytes_;
  std::uint64_t begin_ = 0;  ///< of the buffer in the file
};

/// The content of the frame at an offset. Throws ConfigError naming the file if there is no whole one.
std::string read_frame(const std::string& path, std::uint64_t offset);

}  // namespace solenoid
