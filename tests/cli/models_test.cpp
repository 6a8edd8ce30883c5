// The library of models: whatever folder is in examples/models is checked here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

struct ModelFolder {
  std::string path;
  [[nodiscard]] std::string file(const std::string& name) const { return path + "/" + name; }
  [[nodiscard]] bool has(const std::string& name) const { return fs::exists(file(name)); }
  [[nodiscard]] std::vector<std::string> model() const {
    if (!has("application.xml")) return {file("model.xml")};
    return {file("model.xml"), "--application", file("application.xml")};
  }
};

std::vector<ModelFolder> model_folders() {
  std::set<std::string> paths;
  for (const auto& entry : fs::directory_iterator(ARBITER_SOURCE "/examples/models")) {
    if (entry.is_directory()) paths.insert(entry.path().string());
  }
  std::vector<ModelFolder> folders;
  for (const auto& path : paths) folders.push_back({path});
  return folders;
}

ProgramResult run_verb(const std::string& verb, const std::vector<std::string>& model,
                       const std::vector<std::string>& others = {}) {
  std::vector<std::string> arguments{verb};
  arguments.insert(arguments.end(), model.begin(), model.end());
  arguments.insert(arguments.end(), others.begin(), others.end());
  return arbiter(arguments);
}

TEST(Models, AreWhatIsPromised) {
  std::set<std::string> names;
  for (const auto& folder : model_folders()) {
    names.insert(fs::path(folder.path).filename().string());
    for (const char* file : {"README.md", "model.xml", "trace.csv", "outcome.csv"}) {
      EXPECT_TRUE(folder.has(file)) << folder.path << " lacks " << file;
    }
  }
  for (const char* name : {"emergency_stop", "humanoid", "lease", "search_and_track", "selector",
                           "subsumption", "twist_mux", "velocity_mux"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
}

// "Copy a folder": what leads out of it would be lost.
TEST(Models, AreWholeWhereTheyAreCopied) {
  const TemporaryDirectory directory;
  for (const auto& folder : model_folders()) {
    const fs::path copy = fs::path(directory.path()) / fs::path(folder.path).filename();
    fs::copy(folder.path, copy, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
    const auto result = run_verb("check", ModelFolder{copy.string()}.model());
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
}

TEST(Models, PassTheCheckWithoutErrorsAndWarnings) {
  for (const auto& folder : model_folders()) {
    SCOPED_TRACE(folder.path);
    const auto result = run_verb("check", folder.model());
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.err, Not(HasSubstr(": error: ")));
    EXPECT_THAT(result.err, Not(HasSubstr(": warning: ")));
  }
}

TEST(Models, DecideTheirTracesAsTheirPagesExplain) {
  for (const auto& folder : model_folders()) {
    SCOPED_TRACE(folder.path);
    const auto result = run_verb("simulate", folder.model(), {"--trace", folder.file("trace.csv")});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.err, Not(HasSubstr("unknown-source")));
    EXPECT_EQ(result.out, content_of(folder.file("outcome.csv")));
  }
}

// What compile makes of them decides alike: as model and application in one, and as the application
// of the model.
TEST(Models, DecideAlikeWhenTheyAreMergedIntoTheirApplications) {
  const TemporaryDirectory directory;
  const std::string merged = directory.path() + "/merged.xml";
  for (const auto& folder : model_folders()) {
    SCOPED_TRACE(folder.path);
    const auto compiled = run_verb("compile", folder.model(), {"-o", merged, "--force"});
    ASSERT_EQ(compiled.exit_code, 0) << compiled.err;
    const std::vector<std::string> trace{"--trace", folder.file("trace.csv")};
    const std::string outcome = content_of(folder.file("outcome.csv"));
    EXPECT_EQ(run_verb("simulate", {merged}, trace).out, outcome);
    EXPECT_EQ(run_verb("simulate", {merged, "--application", merged}, trace).out, outcome);
    EXPECT_EQ(run_verb("simulate", {folder.file("model.xml"), "--application", merged}, trace).out,
              outcome);
    const auto rules = run_verb("rules", folder.model());
    EXPECT_EQ(run_verb("rules", {merged}).out, rules.out);
  }
}

TEST(Models, CanBeDrawn) {
  for (const auto& folder : model_folders()) {
    for (const char* view : {"behaviours", "connections", "both"}) {
      SCOPED_TRACE(folder.path + " " + view);
      const auto result = run_verb("graph", folder.model(), {"--view", view, "--format", "dot"});
      EXPECT_EQ(result.exit_code, 0);
      EXPECT_THAT(result.out, HasSubstr("digraph"));
    }
  }
}

}  // namespace
}  // namespace arbiter::test
