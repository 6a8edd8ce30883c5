// arbiter simulate --why: what changed the winners of a trace or a recording, and what kept
// arrivals out.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <ostream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/why_report.hpp"
#include "evidence/records.hpp"
#include "rules/explain/explain.hpp"
#include "rules/explain/simulation.hpp"

namespace arbiter::cli {

// Three kinds of lines, in order of time; activity that runs out between two events has its own.
//   0.100 s  /Gaze/pos:i  /RandomLook/pos:o -> /Face/pos:o  because /Face/pos:o became active; …
//   0.150 s  /Gaze/pos:i  /RandomLook/pos:o discarded: inhibited by …
//   0.700 s  /Gaze/pos:i  /RandomLook/pos:o was discarded 11 more times for that reason, until …
// JSON has each of the discarded ones.
class WhySimulated {
 public:
  static constexpr const char* kWhyOption = "--why=";  // before the port

  struct Options {
    std::string port;  // empty: all
    bool json = false;
    // How a time is told; empty: in seconds.
    std::function<std::string(shm::Nanoseconds)> time{};
    // The time of day, which JSON then has too; empty: it is not known.
    std::function<std::string(shm::Nanoseconds)> clock{};
    // Whether what a source did just then is not in the recording; empty: all is known.
    std::function<bool(const std::string& source, shm::Nanoseconds)> is_in_gap{};
    // Only from the first moment to before the second, and what held as it began.
    shm::Nanoseconds from = 0;
    shm::Nanoseconds to = shm::kForever;
  };

  // Keeps references. Throws std::runtime_error where the model does not know the port.
  WhySimulated(const rules::RuleSet& rules, rules::Simulation& simulation, Options options);

  void step(const rules::TraceEvent& event, std::ostream& out);

  // For recordings, which begin in the middle, and do not know the cause of everything.

  // Takes the activities that the simulation has by now, and tells who wins.
  void begin(std::ostream& out);
  // That is how a source is found at this time.
  void find(const std::string& source, shm::ActivityWord word, shm::Nanoseconds time,
            std::ostream& out);
  // From now on, until `to`, it is not known what the source did.
  void lose(const std::string& source, std::uint64_t events, shm::Nanoseconds from,
            shm::Nanoseconds to, std::ostream& out);
  // Tells what ends by itself until then.
  void run_out_until(shm::Nanoseconds time, std::ostream& out);
  // What was discarded again, and not told yet: where nothing follows.
  void tell_repeats(std::ostream& out);
  // The same, and what ends by itself until then.
  void end(shm::Nanoseconds time, std::ostream& out);
  // The same, as another model comes into force: whose winner wins no more, for under that nobody
  // does at this port.
  void end_by_model(const evidence::ModelChange& model, shm::Nanoseconds time,
                    const std::function<bool(const std::string& port)>& has_winner,
                    std::ostream& out);
  // Whether it has told anything yet.
  [[nodiscard]] bool has_told() const { return has_told_; }

 private:
  // What was so before the moment that was asked for.
  struct Held {
    shm::PortId port = shm::kNone;  // whose winner it tells
    std::string line;
  };

  // Of one connection, one after the other and for the same reason.
  struct Repeats {
    std::string reason;
    std::uint64_t more = 0;  // than the one that was told
    shm::Nanoseconds last = 0;
  };
  using Connection = std::pair<shm::PortId, std::string>;  // with its source

  void schedule(shm::SourceId source);
  [[nodiscard]] std::string text_of(shm::Nanoseconds time) const;
  [[nodiscard]] std::string time_of_now() const { return text_of(simulation_.now()); }
  [[nodiscard]] bool is_in_gap(const std::string& source) const;
  [[nodiscard]] std::string cause_text(const std::string& source, const Sources& sources) const;
  [[nodiscard]] std::string line_of(nlohmann::json event, shm::Nanoseconds time) const;
  // Of a winner, now.
  void tell(shm::PortId port, std::string line, std::ostream& out);
  void tell_held(std::ostream& out);
  void tell_changes(std::ostream& out);
  void tell_change(shm::PortId port, shm::SourceId before, shm::SourceId now, std::ostream& out);
  void tell_discarded(const rules::OutcomeRow& row, std::ostream& out);
  // Whether it is one more for the same reason, which is counted. What was counted for another one
  // is told.
  bool count_repeat(shm::PortId port, const rules::ConnectionExplanation& connection,
                    std::ostream& out);
  void tell_repeats(const Connection& connection, const Repeats& repeats, std::ostream& out);
  void tell_repeats_at(shm::PortId port, std::ostream& out);
  [[nodiscard]] Sources sources_at(shm::PortId port) const;
  [[nodiscard]] std::string name_of(shm::SourceId winner) const;
  [[nodiscard]] std::optional<rules::ConnectionExplanation> explain(shm::PortId port,
                                                                    const std::string& source,
                                                                    const Sources& sources) const;
  // Of one that had won; empty where nobody had, or it is not active any more.
  [[nodiscard]] std::string loss_of(shm::SourceId before, shm::PortId port,
                                    const Sources& sources) const;

  const rules::Explainer explainer_;
  rules::Simulation& simulation_;
  const Options options_;
  std::vector<shm::SourceId> winners_;                         // by port
  std::vector<bool> was_active_;                               // by source, when last told
  std::set<std::pair<shm::Nanoseconds, shm::SourceId>> ends_;  // of activity, as it was scheduled
  std::vector<Held> held_;
  std::map<Connection, Repeats> repeats_;
  bool has_told_ = false;
};

}  // namespace arbiter::cli
