// An application file, beside a model of which it has all connections, or not.
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "tests/fuzz/file_in_memory.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/live_table.hpp"

namespace arbiter::fuzz {
namespace {

constexpr std::string_view kModel =
    "<behaviors><arbiter at='/p'><select from='/s'/></arbiter></behaviors>";

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
