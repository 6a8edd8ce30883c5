// An input port of a running instance: the model in force, the activity of all sources that matter
// to the port, at one moment, who wins, and why.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "rules/explain/explain.hpp"
#include "rules/text/diagnostic.hpp"
#include "shm/activity.hpp"
#include "shm/ids.hpp"
#include "watch/instance.hpp"
#include "watch/model_in_force.hpp"
#include "watch/picture.hpp"
#include "watch/sources.hpp"

namespace arbiter::watch {

// What was asked for is not there: the message says what is.
class WatchError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One look at a port.
struct Look {
  Picture picture;  // of all sources that the port heeds
  bool is_arbitrated = false;
  bool is_mentioned = false;  // the model in force knows the port
  shm::SourceId winner = shm::kNone;
  Sources sources;  // the picture, by name

  [[nodiscard]] std::uint64_t generation() const { return picture.snapshot.generation; }
  [[nodiscard]] const shm::TableView& table() const { return picture.snapshot.table; }
};

// A picture that somebody has kept, by name.
struct KeptPicture {
  std::uint64_t generation = 0;  // of the model that was in force
  shm::Nanoseconds now = 0;
  std::map<std::string, shm::ActivityWord> words;
  bool is_settled = true;
};

class Port {
 public:
  // Keeps the instance. Throws WatchError where nobody has named such an input port.
  Port(std::shared_ptr<Instance> instance, std::string name);

  // Asks nobody. Throws WatchError where a daemon has come that does not have the memory of the one
  // in which the port was found.
  [[nodiscard]] Look look() const;
  // What look() would have said then; of a source that the picture lacks, as of one that has no
  // page. Throws WatchError also where another model has come into force since.
  [[nodiscard]] Look look_back(const KeptPicture& kept) const;
  // By the texts of the model that the look was taken under; nothing if another one has come into
  // force since: look again. Asks the daemon where it is a model that was not explained before.
  // Throws as Instance::ask(), and WatchError.
  std::optional<rules::PortExplanation> explain(const Look& look);

  // To be called when another model has come into force, and the instance has caught up with it: a
  // port that no model needed for a while, and nobody has open, has another id when it is needed
  // again. Asks nobody.
  void find_again();

  [[nodiscard]] Instance& instance() const { return *instance_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] shm::PortId id() const { return id_; }
  [[nodiscard]] const std::string& source_name(shm::SourceId source) const {
    return memory_->source_name(source);
  }
  // That was explained last.
  [[nodiscard]] const ModelInForce& model() const { return model_; }
  // What it mentions; nothing where the daemon does not know its texts.
  [[nodiscard]] const std::vector<std::string>& known_sources() const { return rules_.sources; }
  [[nodiscard]] std::vector<std::string> known_ports() const {
    return rules::Explainer(rules_).ports();
  }
  // What was found when it was loaded.
  [[nodiscard]] const rules::Diagnostics& diagnostics() const { return diagnostics_; }
  // With where T comes from, and what it was. `look` must be of that model.
  void add_timeouts(Look& look) const;

 private:
  void require_memory() const;
  void read_table(Look& look) const;
  void fetch_model();

  const std::shared_ptr<Instance> instance_;
  const std::shared_ptr<const shm::DecisionMemory> memory_;
  const std::string name_;
  shm::PortId id_;
  std::optional<std::uint64_t> generation_;  // of what follows
  ModelInForce model_;
  rules::RuleSet rules_;
  rules::Diagnostics diagnostics_;
};

}  // namespace arbiter::watch
