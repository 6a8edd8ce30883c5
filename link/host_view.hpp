// What a link knows of its own host: which sources the model in force wants, and which ones
// components have open.
//
// Thread safety: one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "link/core/demand.hpp"
#include "shm/activity.hpp"
#include "shm/type_info.hpp"
#include "watch/instance.hpp"
#include "wire/status.hpp"

namespace arbiter::link {

class HostView {
 public:
  // `instance`: as NodeOptions has it. `max_age`: how old a sample may be at most; nothing: as the
  // model says.
  HostView(std::string instance, std::optional<shm::Nanoseconds> max_age);

  // Takes up what has changed. Asks the daemon at most four times a second, and waits for its
  // answer for a second at most. What was known stays where there is no daemon. `model_is_known` is
  // called once wanted() is that of the model in force, before the daemon is asked what is open.
  void update(const std::function<void()>& model_is_known);

  // The sources that the model in force connects or reads, with how old their samples may be when
  // they arrive: T, or max_age where that is shorter; for `forever` max_age, or without one the
  // model's own timeout.
  [[nodiscard]] const std::map<std::string, shm::Nanoseconds, std::less<>>& wanted() const {
    return wanted_;
  }
  // What the model does with one of them.
  [[nodiscard]] SourceUse use_of(const std::string& source) const;
  // Those that components of this host have open, or had when their daemon went; with what a sample
  // is.
  using OpenPorts = std::map<std::string, shm::TypeInfo, std::less<>>;
  [[nodiscard]] const OpenPorts& open_here() const { return open_here_; }
  // The input ports that components of this host have open.
  [[nodiscard]] const std::set<std::string, std::less<>>& inputs_here() const {
    return inputs_here_;
  }
  // What is in force; generation 0: nothing.
  struct Model {
    std::uint64_t generation = 0;
    std::string name;          // empty: it has none
    std::uint64_t digest = 0;  // of its texts; 0: the daemon does not have them
  };
  [[nodiscard]] const Model& model() const { return model_; }
  // Whether its activity was ended, and nothing has come since.
  [[nodiscard]] bool is_deactivated(const std::string& source) const;
  // False: ports cannot be opened now, and an attempt waits for a second.
  [[nodiscard]] bool has_daemon() const { return instance_ != nullptr && instance_->has_daemon(); }
  // When the daemon turned this link away the last time, as it does for 2 s or longer: it does not
  // know what the link has open, because the state of the daemon before is lost. 0: it does.
  [[nodiscard]] shm::Nanoseconds turned_away() const { return turned_away_; }
  // Why nothing is known; empty: it is.
  [[nodiscard]] const std::string& obstacle() const { return obstacle_; }

 private:
  bool join();
  void look_at_model();
  void look_at_ports();
  wire::Status ask_status(shm::Nanoseconds now);
  void know_model(const wire::ModelStatus& model);

  const std::string instance_name_;
  const std::optional<shm::Nanoseconds> max_age_;
  std::unique_ptr<watch::Instance> instance_;
  std::map<std::string, shm::Nanoseconds, std::less<>> wanted_;
  std::map<std::string, SourceUse, std::less<>> uses_;
  OpenPorts open_here_;
  std::set<std::string, std::less<>> inputs_here_;
  shm::Nanoseconds turned_away_ = 0;
  Model model_;
  std::uint64_t model_of_daemon_ = 0;
  std::shared_ptr<const shm::DecisionMemory> memory_;  // of what follows
  std::uint64_t generation_ = 0;
  std::string obstacle_;
  shm::Nanoseconds join_again_ = 0;
  shm::Nanoseconds ask_again_ = 0;
};

}  // namespace arbiter::link
