#include "cli/other_hosts.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "wire/document.hpp"

namespace arbiter::cli {
namespace {

TEST(StatusOfAnotherHost, SaysNothingThatATerminalObeys) {
  wire::Status status;
  status.inputs.emplace_back().name = "/x\x1b]0;owned\x07\x1b[2J";
  status.sources.emplace_back().name = "/plain:o";
  const wire::Status read = read_status_of_host(wire::write_document(wire::to_json(status)));
  ASSERT_EQ(read.inputs.size(), 1u);
  EXPECT_EQ(read.inputs[0].name.find_first_of("\x1b\x07"), std::string::npos);
  EXPECT_NE(read.inputs[0].name.find("owned"), std::string::npos);
  ASSERT_EQ(read.sources.size(), 1u);
  EXPECT_EQ(read.sources[0].name, "/plain:o");
  EXPECT_THROW(static_cast<void>(read_status_of_host("[")), wire::DocumentError);
}

}  // namespace
}  // namespace arbiter::cli
