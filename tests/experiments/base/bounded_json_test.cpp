#include "experiments/base/bounded_json.hpp"

#include "core/config/reader.hpp"

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string repeated(const std::string& text, std::size_t times) {
  std::string all;
  all.reserve(text.size() * times);
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

std::string refusal_of_json(const std::string& text) {
  try {
    parse_json(text, "some.json");
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), Not(HasSubstr("json.exception")));
    EXPECT_THAT(error.what(), HasSubstr("(allowed: "));
    return error.what();
  }
  return "nothing";
}

TEST(BoundedJson, WhatIsWithinBoundsIsReadInItsOrder) {
  const auto json = parse_json(R"({"b": [1, {"c": null}], "a": "text"})", "some.json");
  EXPECT_EQ(json.dump(), R"({"b":[1,{"c":null}],"a":"text"})");
  const auto deep = json_bounds::depth;
  EXPECT_NO_THROW(parse_json(repeated("[", deep) + repeated("]", deep), "some.json"));
}

TEST(BoundedJson, DepthIsBounded) {
  for (const std::size_t depth : {std::size_t{json_bounds::depth} + 1, std::size_t{200'000}}) {
    EXPECT_THAT(refusal_of_json(repeated("[", depth) + repeated("]", depth)), HasSubstr("some.json: nested"));
    EXPECT_THAT(refusal_of_json(repeated("{\"a\":", depth) + "1" + repeated("}", depth)), HasSubstr("nested"));
    EXPECT_THAT(refusal_of_json(repeated("[", depth)), HasSubstr("nested"));
  }
}

TEST(BoundedJson, ValuesAndKeysAreBounded) {
  EXPECT_THAT(refusal_of_json("[" + repeated("1,", json_bounds::values) + "1]"), HasSubstr("values"));
  std::string object = "{";
  for (int key = 0; key < 20'000; ++key) object += std::to_string(key) + ":1,";
  EXPECT_THAT(refusal_of_json(object), HasSubstr("not valid JSON"));  // keys are texts
  object = "{";
  for (int key = 0; key < 20'000; ++key) object += "\"" + std::to_string(key) + "\":1,";
  EXPECT_THAT(refusal_of_json(object + "\"a\":1}"), HasSubstr("too many keys"));
}

TEST(BoundedJson, WhatIsNotValidIsToldWithItsLine) {
  EXPECT_THAT(refusal_of_json(""), HasSubstr("some.json:1: not valid JSON at column 1 (allowed: "));
  EXPECT_THAT(refusal_of_json("{\n  \"a\": 1,\n  oops\n}"), HasSubstr("some.json:3: not valid JSON at column 3"));
  EXPECT_THAT(refusal_of_json("{\"a\": \"\xff\"}"), HasSubstr("some.json:1: not valid JSON"));
  EXPECT_THAT(refusal_of_json("[1e999]"), HasSubstr("some.json"));
  EXPECT_THAT(refusal_of_json("{} {}"), HasSubstr("some.json:1"));
}

TEST(BoundedJson, ProblemsWithValuesHaveNoForeignNames) {
  try {
    parse_json("{}", "some.json").at("run").get<double>();
    FAIL();
  } catch (const nlohmann::ordered_json::exception& error) {
    EXPECT_EQ(problem_with_json(error), "key 'run' not found");
  }
}

}  // namespace
}  // namespace solenoid
