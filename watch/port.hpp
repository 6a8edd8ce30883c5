// An input port of a running instance: the model in force, the activity of all sources that matter
// to the port, at one moment, who wins, and why.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rules/explain/explain.hpp"
#include "rules/text/diagnostic.hpp"
#include "shm/activity.hpp"
#include "shm/ids.hpp"
#include "shm/table_ring.hpp"
#include "watch/instance.hpp"
#include "watch/model_in_force.hpp"
#include "watch/model_loader.hpp"
#include "watch/picture.hpp"
#include "watch/sources.hpp"
#include "watch/watch_error.hpp"

namespace arbiter::watch {

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

// Of a name that no port has, such as a topic's: "/Nav/cmd:o comes from DDS topic rt/cmd_nav",
// where a component says so of its port. ROS 2 calls that topic /cmd_nav. Empty: nobody does.
[[nodiscard]] std::string port_of_topic(const wire::Status& status, std::string_view name);

class Port {
 public:
  // Keeps the instance. `models`: of the same instance, for several of its ports; null: one of its
  // own. Throws WatchError where nobody has named such an input port.
  Port(std::shared_ptr<Instance> instance, std::string name,
       std::shared_ptr<ModelLoader> models = nullptr);

  // Asks nobody. Throws WatchError where a daemon has come that does not have the memory of the one
  // in which the port was found.
  [[nodiscard]] Look look() const;
  // What look() would have said then; of a source that the picture lacks, as of one that has no
  // page. Throws WatchError also where another model has come into force since.
  [[nodiscard]] Look look_back(const KeptPicture& kept) const;
  // Whether all that was read of a look's table so far was the table's own.
  [[nodiscard]] bool is_whole(const shm::TableSnapshot& snapshot) const {
    return memory_->tables().is_whole(snapshot);
  }
  // By the texts of the model that the look was taken under; nothing if another one has come into
  // force since: look again. Asks the daemon where it is a model that was not explained before.
  // Throws as Instance::ask(), and WatchError, also where a daemon has come that does not have the
  // memory of the one in which the port was found.
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
  // That was explained last, as what follows: one must have been.
  [[nodiscard]] const ModelInForce& model() const { return model_->in_force; }
  // What it mentions; nothing where the daemon does not know its texts.
  [[nodiscard]] const std::vector<std::string>& known_sources() const {
    return model_->rules.sources;
  }
  [[nodiscard]] std::vector<std::string> known_ports() const {
    return rules::Explainer(model_->rules).ports();
  }
  // What was found when it was loaded.
  [[nodiscard]] const rules::Diagnostics& diagnostics() const { return model_->diagnostics; }
  // With where T comes from, and what it was. `look` must be of that model.
  void add_timeouts(Look& look) const;

 private:
  void require_memory() const;
  void read_table(Look& look) const;

  const std::shared_ptr<Instance> instance_;
  const std::shared_ptr<const shm::DecisionMemory> memory_;
  const std::string name_;
  shm::PortId id_;
  const std::shared_ptr<ModelLoader> models_;
  std::shared_ptr<const ModelWithRules> model_;  // null: none has been explained yet
};

}  // namespace arbiter::watch
