#include "cli/other_hosts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>

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

// The link has said this half a second ago: /gone:o came from the head, /here:o still does.
class ImportsThatLag : public testing::Test {
 protected:
  ImportsThatLag() {
    hosts_.hosts.emplace_back().host = "head";
    wire::ImportStatus& gone = hosts_.imports.emplace_back();
    gone.source = "/gone:o";
    gone.host = "head";
    wire::ImportStatus& here = hosts_.imports.emplace_back();
    here.source = "/here:o";
    here.host = "head";
    here.is_open = true;
    here.hosts = {"head"};
    for (const char* name : {"/gone:o", "/here:o"}) status_.sources.emplace_back().name = name;
  }

  [[nodiscard]] std::string text() const {
    std::ostringstream out;
    write_imports(out, {"/gone:o", "/here:o"}, status_, hosts_, {});
    return out.str();
  }
  void open(std::size_t source, const std::string& node, const std::string& described) {
    auto& port = status_.sources[source].open.emplace();
    port.component = {node, 12, 1000};
    port.described = described;
  }

  wire::HostsDocument hosts_;
  wire::Status status_;
};

TEST_F(ImportsThatLag, AreOpenAsTheStatusHasThem) {
  EXPECT_EQ(text(),
            "\nFrom other hosts:\n  /gone:o  came from host head, which does not offer it now\n");
  open(0, "arbiter-link", "host rear, 3 lost");
  EXPECT_EQ(text(), "\nFrom other hosts:\n  /gone:o  from host rear, round trip -\n");
  open(1, "arbiter-link", "host head");
  EXPECT_THAT(text(), testing::HasSubstr("  /here:o  from host head, round trip -\n"));
}

TEST_F(ImportsThatLag, AreNotOfOtherHostsWhereAComponentHereHasThemOrDiedWithThem) {
  open(0, "operator", "");
  EXPECT_EQ(text(), "");
  status_.sources[0].open.reset();
  status_.deaths = {{"operator", 12, 1000, 1, {"/gone:o"}, {}, {}}};
  EXPECT_EQ(text(), "");
  status_.deaths.clear();
  status_.sources[0].away_pid = 12;
  EXPECT_EQ(text(), "");
}

TEST_F(ImportsThatLag, SayWhetherTheHostIsHeard) {
  hosts_.hosts[0].is_up = false;
  EXPECT_THAT(text(), testing::HasSubstr("came from host head, which is gone (arbiter hosts)\n"));
}

TEST(APortOnSeveralHosts, IsToldWithEachOtherHostThatIsThere) {
  wire::HostsDocument hosts;
  hosts.host = "base";
  for (const char* name : {"base", "head", "rear", "tail"}) {
    wire::HostStatus& host = hosts.hosts.emplace_back();
    host.host = name;
    host.is_up = host.host != "rear";
    if (host.host != "tail") host.inputs = {"/Arm/pos:i"};
  }
  EXPECT_THAT(others_with_port("/Arm/pos:i", hosts, hosts.host), testing::ElementsAre("head"));
  EXPECT_THAT(others_with_port("/Leg/pos:i", hosts, hosts.host), testing::IsEmpty());
}

}  // namespace
}  // namespace arbiter::cli
