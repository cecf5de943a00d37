#include "core/config/document.hpp"

#include "core/config/reader.hpp"

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace solenoid {
namespace {

using ::testing::StartsWith;

constexpr const char* text = R"(name = "a"
[variant.one]
cost = { air = 1.0 }
blocks = [1, 2]
[variant.one.b]
deep = 1
[variant.two]
[[scenario]]
name = "s"
[[scenario]]
name = "t"
)";

TEST(Document, KnowsTheLineOfEachValueAndTheNearestOfWhatIsMissing) {
  const Document d = Document::from_text(text, "f.toml");
  EXPECT_EQ(d.where("variant.one.cost.air"), "f.toml:3");
  EXPECT_EQ(d.where("variant.one.cost.none"), "f.toml:3");
  EXPECT_EQ(d.where("variant.one.none"), "f.toml:2");
  EXPECT_EQ(d.where("scenario[1].name"), "f.toml:11");
  EXPECT_EQ(d.where("scenario[1].none"), "f.toml:10");
  EXPECT_EQ(d.where("none"), "f.toml:1");
}

TEST(Document, ACopyKeepsWhereItsValuesCameFromAndAChangedValueNamesWhoSetIt) {
  const Document one = Document::from_text(text, "one.toml");
  Document made("made.toml");
  made.root().insert("variant", toml::table{{"mine", *one.root()["variant"]["one"].as_table()}});
  made.comes_from("variant.mine", one, "variant.one");
  EXPECT_EQ(made.where("variant.mine.b.deep"), "one.toml:6");
  made.set_by("variant.mine.b", "the test");
  EXPECT_EQ(made.where("variant.mine.b.deep"), "the test");
  EXPECT_EQ(made.where("variant.mine.blocks"), "one.toml:4");  // begins with a `b` too
  EXPECT_EQ(made.where("name"), "made.toml");
  made.root()["variant"]["mine"]["b"].as_table()->insert_or_assign("deep", -1);
  TableReader deep = TableReader(made).table("variant").table("mine").table("b");
  try {
    deep.number("deep", Range::positive());
    ADD_FAILURE() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), StartsWith("the test: key 'variant.mine.b.deep': -1 is refused"));
  }
}

TEST(Document, ANameInAFileCannotEndTheLineOfItsErrorNorMoveTheCursor) {
  TableReader reader = TableReader::from_text("\"a\\n\\u001B[2Jb\" = 1", "f.toml");
  try {
    reader.finish();
    FAIL() << "an unknown key was taken";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("key 'a\\x0a\\x1b[2Jb'"));
  }
}

TEST(Document, APartIsReadUnderItsPathInTheWhole) {
  const Document whole = Document::from_text(text, "f.toml");
  const Document part = whole.part("scenario[1]", *whole.root()["scenario"][1].as_table());
  TableReader reader(part);
  EXPECT_EQ(reader.text("name"), "t");
  EXPECT_EQ(reader.where("name"), "f.toml:11");
  try {
    reader.number("plane");
    ADD_FAILURE() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), StartsWith("f.toml:10: key 'scenario[1].plane': missing"));
  }
}

TEST(Document, KeysOfManyPartsAreRefusedAndDotsElsewhereAreNot) {
  const auto refused = [](const std::string& toml) {
    try {
      Document::from_text(toml, "f.toml");
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  std::string key = "a", quoted = "'a'", dots;
  for (int part = 0; part < 100'000; ++part) {
    key += ".a";
    quoted += part % 2 ? ". 'a'" : " .\"a\"";
    dots += '.';
  }
  for (const std::string& toml : {"\n" + key + " = 1\n", "\n[" + key + "]\n", "\n[[" + key + "]]\n",
                                  "\n" + quoted + " = 1", "\nb = { " + key + " = 1 }"})
    EXPECT_THAT(refused(toml), StartsWith("f.toml:2: a key of too many parts (allowed: at most 32)"));
  for (const std::string& toml :
       {"# " + dots + "\na = 1", fmt::format("a = \"{0}\\\"{0}\"", dots), "a = '" + dots + "'",
        "a = \"\"\"\n" + dots + "\n\"\"\"\nb = 1", "a = '''" + dots + "'''",
        std::string(
            "a = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.1,"
            "0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]")})
    EXPECT_EQ(refused(toml), "nothing");
  std::string nested = "a.a.a.a.a.a.a.a.a.a";
  for (int level = 0; level < 8; ++level)
    nested = fmt::format("a.a.a.a.a.a.a.a.a.a = {{ {}{} }}", nested, level == 0 ? " = 1" : "");
  EXPECT_THAT(refused(nested), StartsWith("f.toml:1: nested more than 64 deep"));
}

TEST(Document, ReadsTheFilesItCarriesAndThoseBesideIt) {
  const std::string folder = ::testing::TempDir();
  std::ofstream(folder + "document_beside.toml") << "x = 1\n";
  Document d = Document::from_text("a = 'document_beside.toml'\nb = 'carried.toml'\nc = 'document_none.toml'\n",
                                   folder + "f.toml");
  d.carry("carried.toml", "x = 2\n");
  TableReader reader(d);
  EXPECT_EQ(reader.file_table("a").number("x"), 1.0);
  EXPECT_EQ(reader.file_table("b").number("x"), 2.0);
  EXPECT_FALSE(reader.file("c").text);
  EXPECT_THROW(reader.file_table("c"), ConfigError);
  std::filesystem::remove(folder + "document_beside.toml");
}

}  // namespace
}  // namespace solenoid
