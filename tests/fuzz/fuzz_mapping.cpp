// A gateway's mapping: whatever stands in it, it is judged, and what is accepted is within bounds.
#include "gateway/mapping/check_mapping.hpp"
#include "gateway/mapping/read_mapping.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace arbiter::fuzz {
namespace {

void check_entry(const gateway::Gateway& of, const gateway::Entry& entry) {
  require(entry.dds.has_value() == (of.kind == gateway::Kind::kDds), "a topic of its kind");
  require(entry.iceoryx.has_value() != entry.dds.has_value(), "one topic");
  require(entry.port.has_value() != entry.choice.has_value(), "one port, or two");
  require(entry.is_in() || entry.port.has_value(), "what is sent comes of one port");
  require(entry.max_size >= 1 && entry.max_size <= gateway::kMaxSampleBytes + 8192,
          "the size is bounded");
  require(entry.idle.sample.size() <= gateway::kMaxIdleBytes + 8192, "the idle sample is bounded");
  require(entry.outside().size() < 1024, "names are bounded");
  for (const gateway::Port* port : entry.ports()) {
    require(!port->name.empty() && port->name[0] == '/', "a port has a name");
  }
}

void check_mapping(const std::string& text) {
  const rules::TextFile file("mapping", text);
  rules::Diagnostics diagnostics;
  const gateway::Mapping mapping = gateway::read_mapping(file, diagnostics);
  check_findings(diagnostics);
  if (diagnostics.has_errors()) return;
  std::size_t entries = 0;
  for (const gateway::Gateway& each : mapping.gateways) {
    entries += each.entries.size();
    for (const gateway::Entry& entry : each.entries) check_entry(each, entry);
  }
  require(entries <= gateway::kMaxEntries, "the number of entries is bounded");
  gateway::check_mappings({mapping}, nullptr, diagnostics);
  check_findings(diagnostics);
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  arbiter::fuzz::check_mapping(arbiter::fuzz::text_of(data, size));
  return 0;
}
