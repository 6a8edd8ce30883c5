// An input port of the running system, as an observer sees it: the model in force, the activity of
// all sources that matter to the port, at one moment.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/live.hpp"
#include "cli/model_in_force.hpp"
#include "cli/why_report.hpp"
#include "rules/explain/explain.hpp"
#include "shm/ids.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::cli {

// One consistent picture, as decisions take it.
struct Look {
  shm::TableSnapshot snapshot;
  bool is_arbitrated = false;
  bool is_mentioned = false;  // the model in force knows the port
  std::map<shm::SourceId, shm::ActivityWord> words;
  Sources sources;         // the same by name, and the time
  bool is_settled = true;  // else sources changed too fast for one picture
  shm::SourceId winner = shm::kNone;

  [[nodiscard]] bool is_active(shm::SourceId source) const {
    const auto found = words.find(source);
    return found != words.end() && shm::is_active(found->second, sources.now());
  }
  // When the first of the activities ends by itself.
  [[nodiscard]] shm::Nanoseconds next_end() const;
};

class LivePort {
 public:
  // Throws Error where there is no such input port.
  LivePort(std::shared_ptr<detail::NodeCore> node, std::string port);

  // Throws Error where a daemon has come that does not have the memory of the one we asked.
  [[nodiscard]] Look look() const;
  // By the texts of the model that the look was taken under; nothing if another one has come into
  // force since: look again.
  std::optional<rules::PortExplanation> explain(const Look& look);

  // Else what it decided last goes on, and can be looked at.
  [[nodiscard]] bool has_daemon() const { return node_->has_daemon(); }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] shm::PortId id() const { return id_; }
  [[nodiscard]] std::string source_name(shm::SourceId source) const;
  // That was explained last.
  [[nodiscard]] const ModelInForce& model() const { return model_; }
  // What it mentions; nothing where the daemon does not know its texts.
  [[nodiscard]] const std::vector<std::string>& known_sources() const { return rules_.sources; }
  [[nodiscard]] std::vector<std::string> known_ports() const {
    return rules::Explainer(rules_).ports();
  }
  // What loading it has said of names that nobody has.
  [[nodiscard]] const std::vector<rules::Diagnostic>& name_warnings() const {
    return name_warnings_;
  }
  // With where T comes from, and what it was. `look` must be of that model.
  void add_timeouts(Look& look) const;

 private:
  void fetch_model();

  const std::shared_ptr<detail::NodeCore> node_;
  const std::shared_ptr<const detail::SharedMemory> memory_;
  const std::string name_;
  const shm::PortId id_;
  std::optional<std::uint64_t> generation_;  // of what follows
  ModelInForce model_;
  rules::RuleSet rules_;
  std::vector<rules::Diagnostic> name_warnings_;
};

}  // namespace arbiter::cli
