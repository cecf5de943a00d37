#include "core/config/whole_file.hpp"

#include "core/config/reader.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace solenoid {
namespace {

using ::testing::HasSubstr;

class WholeFile : public testing::Test {
 protected:
  WholeFile() { std::filesystem::create_directory(folder_); }
  ~WholeFile() override { std::filesystem::remove_all(folder_); }
  std::string file(const std::string& name) const { return folder_ + "/" + name; }
  static std::string refusal_of_file(const std::string& path, std::size_t most) {
    try {
      read_whole_file(path, most);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "nothing";
  }

  std::string folder_ = testing::TempDir() + "solenoid_whole_file_" + std::to_string(::getpid());
};

TEST_F(WholeFile, IsReadToItsLastByte) {
  const std::string text("a\0b\n\xff", 5);
  std::ofstream(file("a"), std::ios::binary) << text;
  EXPECT_EQ(read_whole_file(file("a"), 5), text);
  std::ofstream(file("empty")) << "";
  EXPECT_EQ(read_whole_file(file("empty"), 0), "");
}

TEST_F(WholeFile, ThatIsNotThereIsNothing) {
  EXPECT_EQ(read_whole_file(file("none")), std::nullopt);
  EXPECT_EQ(read_whole_file(file("none/a")), std::nullopt);
  EXPECT_EQ(read_whole_file(folder_), std::nullopt);
}

TEST_F(WholeFile, ThatTellsNoSizeIsBoundedToo) {
  EXPECT_THAT(read_whole_file("/proc/self/status").value_or(""), HasSubstr("Name:"));
  EXPECT_THAT(refusal_of_file("/proc/self/status", 10), HasSubstr("at most 10 bytes"));
}

TEST_F(WholeFile, ThatIsTooLargeIsRefusedUnread) {
  std::ofstream(file("large")) << "123456";
  EXPECT_THAT(refusal_of_file(file("large"), 5), HasSubstr("large: is too large (allowed: at most 5 bytes)"));
  std::filesystem::resize_file(file("large"), 40'000'000'000);
  EXPECT_THAT(refusal_of_file(file("large"), 4'000'000), HasSubstr("at most 4 MB"));
}

TEST_F(WholeFile, ThatIsNoneIsRefusedWithoutWaiting) {
  ASSERT_EQ(::mkfifo(file("pipe").c_str(), 0600), 0);
  EXPECT_THAT(refusal_of_file(file("pipe"), 5), HasSubstr("pipe: is a pipe (allowed: a regular file)"));
  EXPECT_THAT(refusal_of_file("/dev/zero", 5), HasSubstr("/dev/zero: is a device"));
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  const int descriptor = ::socket(AF_UNIX, SOCK_STREAM, 0);
  file("s").copy(at.sun_path, sizeof at.sun_path - 1);
  ASSERT_EQ(::bind(descriptor, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  EXPECT_THAT(refusal_of_file(file("s"), 5), HasSubstr("is a socket"));
  ::close(descriptor);
}

}  // namespace
}  // namespace solenoid
