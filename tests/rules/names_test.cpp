#include "rules/text/names.hpp"

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

#include "shm/utf8.hpp"

namespace arbiter::rules {
namespace {

using testing::HasSubstr;

TEST(Names, AreTrimmedAndInnerWhiteSpaceIsOneBlank) {
  EXPECT_EQ(collapse_blanks(" \n Look \t\r\n Around "), "Look Around");
  EXPECT_EQ(collapse_blanks(" \n "), "");
  EXPECT_EQ(collapse_blanks(""), "");
}

TEST(Names, OfPortsTakeAnyPrintableCharacter) {
  for (const std::string name :
       {"/a", "/", "/Face/pos:o", "/a-b_c.d/0", "/größe+1@x,y*", "/日本", "//", "/&<>'"}) {
    EXPECT_FALSE(find_problem_in_port(name)) << name;
    EXPECT_TRUE(shm::is_port_name(name)) << name;
  }
  EXPECT_FALSE(find_problem_in_port("/" + std::string(254, 'x')));
}

TEST(Names, OfPortsAreRefusedAtTheVeryByteThatIsWrong) {
  struct Case {
    std::string name;
    std::size_t at;
    std::string message;
  };
  const std::vector<Case> cases{
      {"Face/pos:o", 0, "begins with '/'; write \"/Face/pos:o\""},
      {"/a b", 2, "white space"},
      {"/a\n/b", 2, "are several names; write an element for each"},
      {"/a, /b", 3, "are several names"},
      {"$a", 0, "a define is used as ${name}"},
      {"/a\"b", 2, "a double quote"},
      {"/ä\xc2\xa0", 3, "an invisible character"},
      {"/a\xe2\x80\x8b", 2, "an invisible character"},
      {"/a\x7f", 2, "an invisible character"},
      {"/a\xc2\x85", 2, "an invisible character"},
      {"/a\xff", 2, "not UTF-8"},
  };
  for (const Case& c : cases) {
    EXPECT_FALSE(shm::is_port_name(c.name)) << c.name;
    const auto problem = find_problem_in_port(c.name);
    ASSERT_TRUE(problem) << c.name;
    EXPECT_EQ(problem->code, "invalid-port-name");
    EXPECT_EQ(problem->at, c.at) << c.name;
    EXPECT_THAT(problem->message, HasSubstr(c.message));
  }
}

TEST(Names, LongerThanTheLimitAreRefused) {
  const auto problem = find_problem_in_port("/" + std::string(255, 'x'));
  ASSERT_TRUE(problem);
  EXPECT_EQ(problem->code, "name-too-long");
  EXPECT_THAT(problem->message, HasSubstr("has 256 bytes, more than the limit of 255"));
  EXPECT_TRUE(find_problem_in_behaviour(std::string(256, 'x')));
  EXPECT_FALSE(find_problem_in_behaviour(std::string(255, 'x')));
}

TEST(Names, ThatAreLongAreCutInMessagesBetweenCharacters) {
  EXPECT_EQ(quote("short"), "\"short\"");
  EXPECT_EQ(quote("say \"hi\""), "\"say 'hi'\"");
  EXPECT_EQ(quote(std::string(200, 'x')), '"' + std::string(80, 'x') + "…\"");
  EXPECT_EQ(quote(std::string(79, 'x') + "ä" + std::string(9, 'x')),
            '"' + std::string(79, 'x') + "…\"");
}

TEST(Names, AMisspeltOneIsRecognised) {
  const std::vector<std::string_view> known{"Look Around", "Follow Face", "Rest Arm"};
  EXPECT_EQ(find_similar("Look Arond", known), "Look Around");
  EXPECT_EQ(find_similar("look around", known), "Look Around");
  EXPECT_EQ(find_similar("RestArm", known), "Rest Arm");
  EXPECT_EQ(find_similar("Track Object", known), std::nullopt);
  EXPECT_EQ(find_similar("", known), std::nullopt);
  EXPECT_EQ(find_similar("B", {"A"}), std::nullopt) << "one letter is like any other";
  EXPECT_EQ(find_similar("/zz:o", {"/a:o"}), std::nullopt) << "of a port's name, the letters";
  EXPECT_EQ(find_similar("/P", {"/p"}), "/p");
  EXPECT_EQ(find_similar("/faec:o", {"/face:i", "/face:o"}), "/face:o");
  EXPECT_EQ(find_similar("/a:i", {"/b:i", "/a:o"}), "/a:o") << "the other end";
  EXPECT_EQ(find_similar("/CMD", {"/cmd:i"}), "/cmd:i");
  EXPECT_EQ(find_similar("a:o", {"/a:o"}), "/a:o") << "the slash is missing";
  EXPECT_EQ(find_similar("/stp:o", {"/stop:i"}), "/stop:i");
  EXPECT_EQ(find_similar("abcd", {"abxy", "abcx"}), "abcx") << "the nearest one";
  EXPECT_EQ(find_similar("wyh", {"who", "why"}), "why") << "two in the wrong order are one slip";
  EXPECT_EQ(find_similar("oLko Around", known), "Look Around");
  EXPECT_EQ(find_similar("hyw", {"why"}), std::nullopt);
  EXPECT_EQ(advise("RestArm", known, "define it"), "; did you mean \"Rest Arm\"?");
  EXPECT_EQ(advise("Fly", known, "define it"), "; define it");
}

}  // namespace
}  // namespace arbiter::rules
