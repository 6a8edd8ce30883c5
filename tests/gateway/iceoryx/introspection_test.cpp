// What iceoryx's own program lists of the gateway, beside what the mapping says.
#include <gtest/gtest.h>
#include <unistd.h>

#include <set>
#include <sstream>
#include <string>

#include "tests/gateway/iceoryx/scene.hpp"
#include "tests/support/emulated_terminal.hpp"

namespace arbiter::test {
namespace {

// "Service/Instance/Event" of each.
using Ends = std::set<std::string>;

// iox-introspection-client, on a screen that has room for all that it has to say.
class Introspection {
 public:
  // Of those that the process has.
  [[nodiscard]] Ends publishers_of(const std::string& runtime) {
    return ends_of(runtime, "Publisher Ports", "Subscriber Ports");
  }
  [[nodiscard]] Ends subscribers_of(const std::string& runtime) {
    return ends_of(runtime, "Subscriber Ports", "");
  }
  // Whether RouDi's list comes to be so.
  bool comes_to(const std::function<bool()>& holds) { return screen_.wait_until(holds); }
  [[nodiscard]] std::string text() const { return screen_.text(); }

 private:
  // Between two headings; the columns are service, instance, event, process, and more. What is too
  // long for its column goes on in the next row, where there is no service.
  [[nodiscard]] Ends ends_of(const std::string& runtime, const std::string& first,
                             const std::string& last) {
    std::vector<std::vector<std::string>> ends;
    bool is_between = false;
    for (int i = 0; i < screen_.size().rows; ++i) {
      const std::string row = screen_.row(i);
      if (row.find(first) != std::string::npos) is_between = true;
      if (!last.empty() && row.find(last) != std::string::npos) is_between = false;
      const auto cells = cells_of(row);
      if (!is_between || cells.size() < 4) continue;
      if (!cells[0].empty()) {
        ends.push_back(cells);
      } else if (!ends.empty()) {
        for (std::size_t k = 1; k < 4; ++k) ends.back()[k] += cells[k];
      }
    }
    Ends result;
    for (const auto& end : ends) {
      if (end[3] == runtime) result.insert(end[0] + "/" + end[1] + "/" + end[2]);
    }
    return result;
  }

  static std::vector<std::string> cells_of(const std::string& row) {
    std::vector<std::string> cells;
    std::istringstream in(row);
    for (std::string cell; std::getline(in, cell, '|');) {
      const auto begin = cell.find_first_not_of(' ');
      const auto end = cell.find_last_not_of(' ');
      cells.push_back(begin == std::string::npos ? "" : cell.substr(begin, end - begin + 1));
    }
    return cells;
  }

  EmulatedTerminal screen_{
      {ARBITER_INTROSPECTION, "--port", "--time", "500"},
      {{"TERM", "xterm-256color"}, {"LINES", std::nullopt}, {"COLUMNS", std::nullopt}},
      {200, 200}};
};

std::string name_of_worker(pid_t worker) {
  return "arbiter-gateway-iceoryx-" + std::to_string(worker);
}

// Besides the mapping's, it has the ends by which it hears of others.
const std::string kPorts = "Introspection/RouDi_ID/Port";
const std::string kThroughput = "Introspection/RouDi_ID/PortThroughput";

TEST_F(Iceoryx, ItsOwnIntrospectionListsOfTheGatewayWhatTheMappingSays) {
  const Roudi roudi(directory_);
  Spoken gate =
      gateway(directory_, in("low", "/Low:o") + in("high", "/High:o") + out("/Base:i", "base"));
  wait_for_description("/High:o", "no publisher matched");
  Introspection introspection;
  const std::string first = name_of_worker(worker_of("/Low:o"));
  // All at once: a list that is only half drawn has some of it.
  ASSERT_TRUE(introspection.comes_to([&] {
    return introspection.publishers_of(first) == Ends{"Test/One/base"} &&
           introspection.subscribers_of(first) ==
               Ends{"Test/One/low", "Test/One/high", kPorts, kThroughput};
  })) << introspection.text();

  // Another mapping: nothing of the one before is left.
  write_mapping(directory_, in("other", "/Low:o") + out("/High:i", "high"));
  gate.process.signal(SIGUSR1);
  wait_until([&] {
    const auto status = daemon_.source("/Low:o");
    return status["open"] == true && name_of_worker(status["component"]["pid"]) != first;
  });
  const std::string second = name_of_worker(worker_of("/Low:o"));
  ASSERT_TRUE(introspection.comes_to([&] {
    return introspection.publishers_of(second) == Ends{"Test/One/high"} &&
           introspection.subscribers_of(second) == Ends{"Test/One/other", kPorts, kThroughput} &&
           introspection.subscribers_of(first).empty() &&
           introspection.publishers_of(first).empty();
  })) << introspection.text();
}

// A stranger that a status names is the one that iceoryx's own program lists.
TEST_F(Iceoryx, WhoPublishesPastArbitrationIsWhomItsOwnIntrospectionLists) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, out("/Base:i", "base"));
  Spoken stranger = plain_publisher("base");
  const std::string name = "plain-publisher-" + std::to_string(stranger.process.pid());
  wait_until([&] { return described_input("/Base:i").find(name) != std::string::npos; });
  Introspection introspection;
  EXPECT_TRUE(introspection.comes_to([&] {
    return introspection.publishers_of(name).contains("Test/One/base");
  })) << introspection.text();
}

}  // namespace
}  // namespace arbiter::test
