// What the public headers take, and what they say of what they do not: programs that are compiled.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/run_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

// What the compiler says of a program that has a node; empty: nothing.
std::string fault_in(const std::string& call, const std::vector<std::string>& options = {}) {
  const TemporaryDirectory files;
  const std::string source = files.write("program.cpp", R"(#include <arbiter/arbiter.hpp>
struct Grip { int force; };
struct Unnamed { int value; };
ARBITER_TYPE(Grip, "gripper/Grip");
void use(arbiter::Node& node) {
)" + call + "\n}\n");
  std::vector<std::string> command{ARBITER_COMPILER, "-std=c++17", "-fsyntax-only",
                                   std::string("-I") + ARBITER_HEADERS};
  command.insert(command.end(), options.begin(), options.end());
  command.push_back(source);
  const ProgramResult result = run_program(command);
  EXPECT_EQ(result.exit_code == 0, result.err.empty());
  return result.err;
}

TEST(Compiling, ReceiversMayNameTheirTypeWithConst) {
  EXPECT_EQ(fault_in(R"(auto in = node.input_port<const Grip>("/in");
  auto tap = node.tap<const Grip>("/out");
  const auto sample = in.take();
  if (sample) static_cast<void>((*sample)->force);)"),
            "");
}

TEST(Compiling, AnOutputPortsTypeIsNotConst) {
  EXPECT_THAT(fault_in(R"(auto out = node.output_port<const Grip>("/out");)"),
              HasSubstr("an output port writes its samples: give its type without const"));
}

TEST(Compiling, WithoutRttiATypeNeedsAName) {
  EXPECT_EQ(fault_in(R"(auto out = node.output_port<Grip>("/out");)", {"-fno-rtti"}), "");
  EXPECT_THAT(
      fault_in(R"(auto out = node.output_port<Unnamed>("/out");)", {"-fno-rtti"}),
      HasSubstr("without RTTI (-fno-rtti) a type has no name of the compiler's: give it one "
                "with ARBITER_TYPE"));
}

TEST(Compiling, ExceptionsAreNeeded) {
  EXPECT_THAT(fault_in("", {"-fno-exceptions"}),
              HasSubstr("arbiter reports errors by exceptions: compile without -fno-exceptions"));
}

TEST(Compiling, ContainersHaveTheLayoutOfTheLibrarys) {
  EXPECT_THAT(fault_in("", {"-D_GLIBCXX_DEBUG"}),
              HasSubstr("arbiter's library has no _GLIBCXX_DEBUG: build both with it"));
  EXPECT_EQ(fault_in("", {"-D_GLIBCXX_DEBUG", "-DARBITER_HAS_GLIBCXX_DEBUG"}), "");
}

}  // namespace
}  // namespace arbiter::test
