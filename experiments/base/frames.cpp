#include "experiments/base/frames.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bytes.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr std::string_view frame_mark = "SLF1";
constexpr std::size_t read_at_once = 1 << 18;

std::uint32_t checksum_of(std::string_view length, std::string_view content) { return crc32(content, crc32(length)); }

/// The content of a frame that begins with these bytes; none: they are of no whole frame.
struct Head {
  std::uint32_t length = 0, checksum = 0;
  bool marked = false;

  explicit Head(std::string_view bytes) {
    marked = bytes.size() >= frame_overhead && bytes.starts_with(frame_mark);
    if (!marked) return;
    length = little_endian<std::uint32_t>(bytes.data() + 4);
    checksum = little_endian<std::uint32_t>(bytes.data() + 8);
    marked = length <= most_content;
  }
  bool is_of(std::string_view frame) const {
    return checksum_of(frame.substr(4, 4), frame.substr(frame_overhead, length)) == checksum;
  }
};

/// Reads as many bytes as there are; their number, or an errno below 0.
ssize_t read_at(const OpenFile& file, char* bytes, std::size_t count, std::uint64_t offset) {
  std::size_t done = 0;
  while (done < count) {
    const ssize_t n = ::pread(file.descriptor(), bytes + done, count - done, static_cast<off_t>(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return -errno;
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return static_cast<ssize_t>(done);
}

OpenFile open_to_read(const std::string& path) {
  struct stat status {};
  OpenFile file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  const int error = file ? EINVAL : errno;
  if (file && ::fstat(file.descriptor(), &status) == 0 && S_ISREG(status.st_mode)) return file;
  throw ConfigError(fmt::format("{}: cannot be read: {} (allowed: a regular file)", path, std::strerror(error)));
}

}  // namespace

FrameWriter::FrameWriter(std::string path) : path_(std::move(path)) {
  require_no_device(path_);
  file_ = OpenFile(::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (!file_) refuse(errno);
  for (int tries = 0; !take_lock(file_, FileLock::alone); ++tries) {
    if (tries == 5) throw FileInUse(fmt::format("{}: in use by another solenoid", path_));
    ::usleep(10'000);  // whoever only asks whether it is in use holds it for a moment
  }
  FrameReader frames(path_);
  while (frames.next()) {
  }
  end_ = frames.end();
  if (frames.rest() > 0 && ::ftruncate(file_.descriptor(), static_cast<off_t>(end_)) != 0) refuse(errno);
}

std::uint64_t FrameWriter::append(std::string_view content) {
  if (content.size() > most_content) throw std::length_error(path_ + ": a frame of more than may be");
  std::string frame(frame_mark);
  append_little_endian(frame, static_cast<std::uint32_t>(content.size()));
  append_little_endian(frame, checksum_of(std::string_view(frame).substr(4, 4), content));
  frame += content;
  std::size_t done = 0;
  while (done < frame.size()) {
    const ssize_t n =
        ::pwrite(file_.descriptor(), frame.data() + done, frame.size() - done, static_cast<off_t>(end_ + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int error = n == 0 ? EIO : errno;
      [[maybe_unused]] const int cut =
          ::ftruncate(file_.descriptor(), static_cast<off_t>(end_));  // else readers skip it
      refuse(error);
    }
    done += static_cast<std::size_t>(n);
  }
  return std::exchange(end_, end_ + frame.size());
}

void FrameWriter::sync() {
  if (::fdatasync(file_.descriptor()) != 0 && errno != EINVAL) refuse(errno);
}

void FrameWriter::refuse(int error) const {
  throw OutputError(fmt::format("{}: cannot be written: {}", path_, std::strerror(error)));
}

FrameReader::FrameReader(std::string path, std::uint64_t from)
    : path_(std::move(path)), file_(open_to_read(path_)), begin_(from), offset_(from), end_(from) {
  struct stat status {};
  if (::fstat(file_.descriptor(), &status) == 0) size_ = static_cast<std::uint64_t>(status.st_size);
  size_ = std::max(size_, from);
}

/// Has the buffer hold so many bytes from offset_ on, if the file has them.
bool FrameReader::fill(std::size_t bytes) {
  const std::uint64_t behind = begin_ + buffer_.size();
  if (offset_ + bytes <= behind) return true;
  if (offset_ + bytes > size_) return false;
  std::string kept = offset_ < behind ? buffer_.substr(static_cast<std::size_t>(offset_ - begin_)) : std::string();
  const std::uint64_t from = offset_ + kept.size();
  const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(std::max(bytes, read_at_once), size_ - from));
  const std::size_t before = kept.size();
  kept.resize(before + wanted);
  const ssize_t n = read_at(file_, kept.data() + before, wanted, from);
  if (n < 0) throw ConfigError(fmt::format("{}: cannot be read: {}", path_, std::strerror(static_cast<int>(-n))));
  kept.resize(before + static_cast<std::size_t>(n));
  buffer_ = std::move(kept);
  begin_ = offset_;
  return buffer_.size() >= bytes;
}

bool FrameReader::next() {
  offset_ = end_;
  while (fill(frame_overhead)) {
    const auto here = [&] { return std::string_view(buffer_).substr(static_cast<std::size_t>(offset_ - begin_)); };
    const Head head(here());
    const std::size_t whole = frame_overhead + head.length;
    if (head.marked && fill(whole) && head.is_of(here())) {
      damaged_ += offset_ - end_;
      content_ = here().substr(frame_overhead, head.length);
      end_ = offset_ + whole;
      return true;
    }
    const std::size_t mark = here().find(frame_mark, 1);
    offset_ += mark == std::string_view::npos ? here().size() - (frame_mark.size() - 1) : mark;
  }
  return false;
}

/// So many bytes of the file from an offset on, or as many as there are.
std::string_view FrameWindow::have(std::uint64_t offset, std::size_t count) {
  if (offset < begin_ || offset + count > begin_ + buffer_.size()) {
    const OpenFile file = open_to_read(path_);
    buffer_.resize(std::max(count, bytes_));
    const ssize_t n = read_at(file, buffer_.data(), buffer_.size(), offset);
    buffer_.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    begin_ = offset;
  }
  return std::string_view(buffer_).substr(static_cast<std::size_t>(offset - begin_), count);
}

std::string_view FrameWindow::content(std::uint64_t offset) {
  const Head head(have(offset, frame_overhead));
  const std::size_t whole = frame_overhead + head.length;
  const std::string_view frame = head.marked ? have(offset, whole) : std::string_view();
  if (frame.size() != whole || !head.is_of(frame))
    throw ConfigError(
        fmt::format("{}: is damaged at byte {} (allowed: a file as `solenoid compare` wrote it)", path_, offset));
  return frame.substr(frame_overhead);
}

std::string read_frame(const std::string& path, std::uint64_t offset) {
  constexpr std::size_t most_records = 4096;  // are shorter
  return std::string(FrameWindow(path, most_records).content(offset));
}

}  // namespace solenoid
