// What a recorder must know beside the events of taps: which sources there are, which model is in
// force, what the pages of sources say that nobody tells of, and which ports are open.
//
//   watched_models.cpp  which model, and which sources that makes it watch
//   watched_ports.cpp   what the daemon is asked for: ports; sources that are no more
//   watcher.cpp         taps, pages; the thread
//
// A thread of its own, because it asks the daemon and opens taps, either of which may wait. It puts
// what it finds into the queue, and hands taps to the thread that polls them. A source that nobody
// has open, that no model names and that the daemon has forgotten is tapped no more: names may come
// and go for as long as it records, and each tap takes descriptors, also of the daemon.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "evidence/rule_table.hpp"
#include "recorder/open_ports.hpp"
#include "recorder/options.hpp"
#include "recorder/record_queue.hpp"
#include "recorder/tap_reader.hpp"
#include "watch/daemon_presence.hpp"
#include "watch/instance.hpp"
#include "watch/model_in_force.hpp"

namespace arbiter::recorder {

class Watcher {
 public:
  // Taps all sources that are to be recorded. Keeps both. Throws wire::CallError, arbiter::Error.
  Watcher(const RecorderOptions& options, RecordQueue& queue);
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;
  ~Watcher() { stop(); }

  // Goes on by itself.
  void start();
  void stop();
  // Once it is stopped: for what has happened last. It does so by itself before. The first asks the
  // daemon, and returns once the taps have all that it has told them: where this process was
  // stopped until now, nothing has been taken up yet.
  void look_once_more();
  void look_at_pages();

  // The thread that polls.

  struct NewTaps {
    std::vector<std::shared_ptr<TapReader>> taps;  // that were opened since
    std::vector<std::shared_ptr<TapReader>> over;  // are to be read once more, and forgotten
  };
  // `forget_all`: where recording starts, or starts again. It forgets the taps before, and puts
  // what they have told last into the queue: the start comes behind it, and nothing of theirs comes
  // behind the start.
  [[nodiscard]] NewTaps take_taps(const std::function<void()>& forget_all);
  // A tap has told of it. Relaxed is enough: it is a hint, and one that is missed comes again.
  void note_ports_changed() { ports_changed_.store(true, std::memory_order_relaxed); }

 private:
  void run();
  void look();
  void tell_of_daemon();
  void tell_of_disk();
  void begin();
  void begin_again();
  void ask_daemon();
  void take_up_model();
  [[nodiscard]] std::set<std::string> chosen_sources(const watch::ModelInForce& model);
  [[nodiscard]] bool is_chosen(const std::string& port) const;
  [[nodiscard]] evidence::ModelChange model_change(const watch::ModelInForce& model) const;
  [[nodiscard]] std::shared_ptr<const evidence::RuleTable> rule_table() const;
  void open_tap(const std::string& source, Batch& batch);
  void hear_what_was_told();
  // Texts about the sources that cannot be recorded, and were not reported yet.
  [[nodiscard]] std::vector<std::string> take_refusals();
  void tap_newcomers(const std::set<std::string>& sources, Batch& batch);
  void look_for_newcomers();
  void add_known_sources(std::set<std::string>& sources) const;
  void forget_gone(const wire::Status& status);
  void push(Batch&& batch);
  void hand_over_taps();
  void hand_over_start(Batch&& start);
  void add_page_state(const std::string& source, Batch& batch) const;
  void add_page_state(const std::string& source, evidence::ActivityWord word, Nanoseconds seen,
                      Batch& batch) const;
  [[nodiscard]] evidence::ActivityWord page_word(const std::string& source) const;
  [[nodiscard]] evidence::ActivityWord page_word(std::optional<shm::SourceId> id) const;
  void find_ids();
  void try_refused();
  void look_at_ports();
  void note_strangers(const std::vector<wire::StrangerStatus>& strangers, Batch& batch);

  const RecorderOptions& options_;
  RecordQueue& queue_;
  std::unique_ptr<watch::Instance> instance_;
  std::shared_ptr<const shm::DecisionMemory> memory_;  // of this run
  std::optional<Node> node_;
  bool has_begun_ = false;  // a recorder that may tap nothing does not; later it may again
  // After which it begins again, and when; 0: the last time it could.
  Nanoseconds begin_pause_ = 0;
  Nanoseconds next_begin_ = 0;
  std::uint64_t generation_ = 0;
  std::vector<std::pair<std::string, std::string>> refusals_;  // sources, and why; not reported yet
  struct Watched {
    std::shared_ptr<TapReader> tap;  // null: it cannot be tapped, and is tried again
    Nanoseconds next_try = 0;
    Nanoseconds pause = 0;            // before that try
    std::optional<shm::SourceId> id;  // as find_ids() has found it
    // Of the page: what it said last, the first look that found it so, and what was put into the
    // queue.
    evidence::ActivityWord seen = shm::kNeverActive;
    Nanoseconds seen_at = 0;
    evidence::ActivityWord reported = shm::kNeverActive;
    std::uint64_t polls = 0;  // of the tap, when that was seen first
  };
  std::map<std::string, Watched> sources_;
  std::set<std::string> named_;  // sources of the chosen ports, by the models
  // Pages of sources that have been forgotten. Who comes under the name again has another page.
  std::map<shm::SourceId, shm::PageNumber> gone_;
  std::vector<std::shared_ptr<TapReader>> over_;  // of these: so that they are not closed elsewhere
  // ActivityPages::changes() when newcomers were looked for, and when ids were. It is never 0 once
  // there is a source.
  std::uint64_t pages_of_newcomers_ = 0;
  std::uint64_t pages_of_ids_ = 0;
  Nanoseconds begun_ = 0;
  // When all sources that there were had taps, where all are recorded; 0: never yet.
  Nanoseconds had_all_ = 0;
  // Output ports and their processes, of components that the daemon does not know.
  std::set<std::pair<std::string, std::int32_t>> strangers_;
  OpenPorts ports_{0};
  watch::DaemonPresence presence_;
  Nanoseconds last_ports_ = 0;
  bool is_disk_slow_ = false;  // it has been told once
  bool may_not_observe_ = false;
  Nanoseconds next_question_ = 0;                   // where it may not
  std::vector<std::shared_ptr<TapReader>> opened_;  // and not handed over yet

  std::mutex mutex_;
  NewTaps new_taps_;             // under it
  std::vector<Batch> to_start_;  // under it: a start that waits for the other thread, and the rest
  std::atomic<bool> ports_changed_{false};
  std::condition_variable stopping_;
  bool is_stopping_ = false;  // under the mutex
  std::thread thread_;
};

}  // namespace arbiter::recorder
