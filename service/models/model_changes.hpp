// How another model, and another policy, come into force: read again, switched to, or gone back to.
//
// What takes long (reading, proving, comparing) the compiler does in its thread, while the loop
// serves others. Whatever it is, it ends in one swap: the new table is written and its clients are
// told before it counts; they switch all at once. Changes wait for each other.
//
//   model_changes.cpp    one change after the other, the swap, and the answers
//   change_kinds.cpp     what each kind of change prepares
//
// Thread safety: none, it is the loop's. What the compiler's thread gets are copies.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "service/clients/clients.hpp"
#include "service/clients/gate.hpp"
#include "service/models/arguments.hpp"
#include "service/models/board.hpp"
#include "service/models/change_queue.hpp"
#include "service/models/compiler.hpp"
#include "service/models/continuity.hpp"
#include "service/models/document.hpp"
#include "service/models/history.hpp"
#include "service/models/library.hpp"
#include "service/models/swap.hpp"
#include "service/ports/introductions.hpp"
#include "service/ports/port_names.hpp"
#include "service/ports/switchboard.hpp"
#include "wire/status.hpp"

namespace arbiter::service {

class ModelChanges {
 public:
  struct Options {
    std::string instance;
    std::vector<NamedFiles> files;  // the first is put in force at the start
    bool is_strict = false;         // takes warnings for errors
    std::uint64_t steps = rules::Budget::kSteps;
    Compiler::Thread compiles_in = Compiler::Thread::kOfItsOwn;
    // For tests: is called in the compiler's thread before files are read.
    std::function<void(std::stop_token)> before_reading{};
  };
  // What a change works upon.
  struct Parts {
    Gate& gate;
    PortNames& names;
    Board& board;
    Switchboard& switchboard;
    Introductions& introductions;
    const Clients& clients;
  };

  // `settled` is called whenever it is decided which model is in force: one has come into force, or
  // the one that start() has found stays.
  ModelChanges(Options options, const Parts& parts, std::function<void()> settled);

  // Reads, before anybody is served, what there is to be read. `is_to_stop` is asked where
  // `stop_descriptor` is readable (-1: nowhere). Throws BadModel, but where only the models have
  // errors and `may_inherit`: start() knows whether there is a model without them. rules::Stopped.
  void read_first(int stop_descriptor, const std::function<bool()>& is_to_stop, bool may_inherit);
  // Puts the first model in force, or the one of the name that a predecessor had. `is_fresh`: there
  // was none, and nothing is in force without it. Throws then, if it cannot be.
  void start(bool is_fresh);

  // Whether `settled` has been called.
  [[nodiscard]] bool has_settled() const { return has_settled_; }

  // Each is answered when it is over. Throws std::length_error where too many wait.
  void ask(Change change, const Client& client, const wire::Message& message);
  // Whether a switch would be made now: answers at once, as for one, and makes none. It is refused
  // as a switch would be, and while another change is under way.
  void ask_ahead(Change change, const Client& client, const wire::Message& message);
  void reload_for_signal(const std::string& by);
  // Begins the next change, if one waits and no other is under way.
  void advance();
  // For a model that waits for its barrier.
  [[nodiscard]] bool has_links_ahead() const { return swap_.has_value(); }
  [[nodiscard]] bool can_advance() const { return !swap_ && !preparing_ && !waiting_.empty(); }
  // Readable once the compiler has prepared one: then finish_preparing().
  [[nodiscard]] int descriptor() const { return compiler_.descriptor(); }
  void finish_preparing();

  [[nodiscard]] const Library& library() const { return library_; }
  // Null: none, or a predecessor's.
  [[nodiscard]] const ModelPointer& in_force() const { return in_force_.model; }
  [[nodiscard]] const History& history() const { return history_; }
  [[nodiscard]] std::uint64_t reloads_refused() const { return reloads_refused_; }
  // Nothing: there are no files, or they have been read.
  [[nodiscard]] std::optional<wire::RefusedFilesStatus> refused_files() const;
  // Of the model in force, for those who explain it. Throws std::system_error, std::runtime_error.
  [[nodiscard]] const shm::FileDescriptor& document();

 private:
  static Change::Asking asking(const Client& client, const wire::Message& message);
  // Calls `step`; where it throws, the change is refused.
  void attempt(Swap& swap, const std::function<void()>& step);
  // For the compiler's thread; `after_reading` may add to what was read.
  [[nodiscard]] Compiler::Job reading_job(
      std::function<void(Reading&, const std::stop_token&)> after_reading) const;
  // What comes of a change is prepared by the compiler, and then finished here.
  void prepare(Swap& swap, Compiler::Job job);
  void stop_preparing_for_nobody();

  void prepare_reload(Swap& swap);
  void finish_reload(Swap& swap, Reading reading);
  // Whether it has other rules than the one in force.
  [[nodiscard]] bool changes_policy(const std::optional<Policy>& policy) const;
  void prepare_switch(Swap& swap);
  [[nodiscard]] const LoadedModel& loaded_model(const std::string& name) const;
  void prepare_rollback(Swap& swap);
  void prepare_look_back(Swap& swap);
  [[nodiscard]] const PastModel& past_model(std::uint64_t asked) const;
  [[nodiscard]] std::string why_none_before() const;
  void prepare_comparison(Swap& swap);
  void finish_comparison(const Swap& swap, const Reading& reading);
  [[nodiscard]] Swap first_swap();

  [[nodiscard]] std::uint64_t content_of(const LoadedModel& next) const;
  void reserve_tables(const Library& library);
  void begin_swap(Swap& swap);
  void put_in_force();
  void settle();
  void remember(const Swap& swap, std::uint64_t generation);

  // Of the report on a change: the policy that was read with it, if there is one.
  [[nodiscard]] static nlohmann::json policy_json(const std::optional<Policy>& policy,
                                                  bool differs);
  void answer_done(const Swap& swap, nlohmann::json changes);
  void answer_refused(const Swap& swap, const std::string& why);
  // `why_not`: of what was refused.
  void answer(const Swap& swap, nlohmann::json document, const std::string& why_not = {});
  // `lacks`: why a report that was wanted is not sent.
  void answer_without_report(const Swap& swap, Client& client, std::uint64_t request,
                             const std::string& why_not, const std::string& lacks);

  const Options options_;
  Gate& gate_;
  PortNames& names_;
  Board& board_;
  Switchboard& switchboard_;
  Introductions& introductions_;
  const Clients& clients_;
  const std::function<void()> settled_;
  bool has_settled_ = false;
  std::vector<ModelPointer> read_at_start_;  // until they are put into the library
  std::string not_read_at_start_;            // why there is none
  std::string why_refused_;                  // why a predecessor's is in force in its place
  Library library_;
  LoadedModel in_force_;  // null: none, or a predecessor's
  History history_;
  Continuity continuity_;
  ModelDocument document_;
  ChangeQueue waiting_;
  std::optional<Swap> swap_;       // the one that waits for its barrier
  std::optional<Swap> preparing_;  // the one that waits for the compiler
  std::uint64_t reloads_refused_ = 0;
  Compiler compiler_;  // last: its job ends before anything else does
};

}  // namespace arbiter::service
