// An application file, beside a model of which it has all connections, or not.
#include "rules/ask/across_hosts.hpp"
#include "rules/model/application_reader.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "tests/fuzz/file_in_memory.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/live_table.hpp"

namespace arbiter::fuzz {
namespace {

constexpr std::string_view kModel =
    "<behaviors><arbiter at='/p'><select from='/s'/></arbiter></behaviors>";

// Where its modules run: each port is on one host, or it is said why not.
void check_hosts(const rules::Application& application, const rules::RuleSet& rules,
                 const rules::CompiledModel& compiled) {
  rules::Diagnostics diagnostics;
  const rules::SourceUses uses = rules::uses_of_sources(rules);
  const rules::HostPlaces places(rules, uses, application, "application.xml", diagnostics);
  for (const rules::PortRules& port : rules.ports) {
    require(diagnostics.has_errors() || !places.of_port(port.port).empty(), "a port has a host");
  }
  rules::Budget budget(1'000'000);
  rules::find_across_hosts(rules, compiled, uses, places, {}, diagnostics, budget);
  check_findings(diagnostics);
}

void check_application(std::string_view text) {
  static const FileInMemory model(kModel);
  static const FileInMemory empty("<behaviors/>");
  const FileInMemory file(text);
  for (const FileInMemory* each : {&model, &empty}) {
    rules::Diagnostics diagnostics;
    const rules::RuleSet rules = rules::load({{each->path()}, file.path()}, diagnostics);
    check_findings(diagnostics);
    if (diagnostics.has_errors()) continue;
    const rules::CompiledModel compiled = rules::compile(rules, diagnostics);
    check_findings(diagnostics);
    if (diagnostics.has_errors()) continue;
    rules::Diagnostics of_file;
    check_hosts(rules::read_application(rules::TextFile(file.path(), std::string(text)), of_file),
                rules, compiled);
    test::LiveTable table(compiled);
    for (const auto& connection : rules.other_connections) {
      const bool delivers = table.delivers(connection.source, connection.port);
      require(delivers == (connection.port != "/p" || each == &empty),
              "what no rule selects delivers at ports that are not arbitrated, and there alone");
    }
  }
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  arbiter::fuzz::check_application(arbiter::fuzz::text_of(data, size));
  return 0;
}
