// A daemon with two models, and what the tool says of changing them.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "tests/cli/arbiter_program.hpp"
#include "tests/client/models.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {

// The models "default", which takes /a, and "other", which takes /b.
class ChangingModels : public testing::Test {
 protected:
  Daemon& start(const std::vector<std::string>& arguments = {}) {
    Daemon::Options options;
    options.arguments = {"--model", "other=" + files_.write("other.xml", only("b"))};
    options.arguments.insert(options.arguments.end(), arguments.begin(), arguments.end());
    return daemon_.emplace(only("a"), options);
  }
  void write_other(const std::string& text) { files_.write("other.xml", text); }

  std::string source_in_force() { return daemon_->input("/in")["connections"][0]["source"]; }
  std::string name_in_force() { return daemon_->status()["model"]["name"]; }

  TemporaryDirectory files_;
  std::optional<Daemon> daemon_;
};

inline void expect_success(const ProgramResult& result, const std::string& out) {
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, out);
  EXPECT_EQ(result.err, "");
}
inline void expect_refusal(const ProgramResult& result, const std::string& err) {
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err, "arbiter: " + err + "\n");
}

}  // namespace arbiter::test
