// A trace: read, written, read again, and replayed against a small model.
#include "rules/explain/simulation.hpp"
#include "rules/explain/trace.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "rules/text/csv.hpp"
#include "tests/fuzz/file_in_memory.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace arbiter::fuzz {
namespace {

constexpr std::size_t kMaxReplayed = 2'000;

rules::CompiledModel small_model() {
  const FileInMemory file(
      "<behaviors timeout='1us'><source port='/e' timeout='forever'/>"
      "<behavior name='A'><config at='/p'>/a</config><config at='/q'>/a</config></behavior>"
      "<behavior name='B'><config at='/p'>/b</config><inhibition>A</inhibition></behavior>"
      "<arbiter at='/r' conflict='first'><select from='/a'>not /e</select><select from='/b'/>"
      "</arbiter></behaviors>");
  rules::Diagnostics diagnostics;
  const auto rules = rules::load({{file.path()}, {}}, diagnostics);
  auto model = rules::compile(rules, diagnostics);
  require(!diagnostics.has_errors(), "the model of this test is a model");
  return model;
}

void write(std::ostream& out, const rules::TraceEvent& event) {
  out << event.at << ',' << rules::to_csv(event.source) << ','
      << (event.kind == rules::TraceKind::kDeactivation ? "deactivate" : "arrive") << '\n';
}

void check_written_again(const std::vector<rules::TraceEvent>& events) {
  std::ostringstream written;
  written << "t_ns,source,event\n";
  for (const auto& event : events) write(written, event);
  rules::Diagnostics diagnostics;
  const rules::TextFile file("again", written.str());
  const auto again = rules::parse_trace(file, diagnostics);
  require(!diagnostics.has_errors() && again.size() == events.size(),
          "what is written can be read");
  for (std::size_t i = 0; i < events.size(); ++i) {
    require(again[i].at == events[i].at && again[i].kind == events[i].kind &&
                again[i].source == events[i].source,
            "it is the same when read again");
  }
}

void replay(const std::vector<rules::TraceEvent>& events) {
  static const rules::CompiledModel model = small_model();
  rules::Simulation simulation(model);
  std::ostringstream out;
  for (std::size_t i = 0; i < std::min(events.size(), kMaxReplayed); ++i) {
    for (const auto& row : simulation.step(events[i])) {
      rules::write_outcome(out, row);
      const bool is_arrival = events[i].kind == rules::TraceKind::kArrival;
      require(is_arrival || !row.outcome.delivered, "only an arrival can be delivered");
      require(!row.outcome.delivered || row.outcome.winner == events[i].source,
              "what is delivered has won");
    }
  }
}

void check_trace(const std::string& text) {
  const rules::TextFile file("trace", text);
  rules::Diagnostics diagnostics;
  const auto events = rules::parse_trace(file, diagnostics);
  check_findings(diagnostics);
  if (diagnostics.has_errors()) return;
  for (std::size_t i = 1; i < events.size(); ++i) {
    require(events[i - 1].at <= events[i].at, "times do not fall");
  }
  check_written_again(events);
  replay(events);
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  arbiter::fuzz::check_trace(arbiter::fuzz::text_of(data, size));
  return 0;
}
