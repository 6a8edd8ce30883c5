// The real ports (client/), put together as the daemon and the service threads do it, without
// either. What a service thread does can be done in the set-up, or by a thread of the scenario.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

#include "client/input/input_core.hpp"
#include "client/output/output_core.hpp"
#include "client/tap/tap_core.hpp"
#include "shm/table_ring.hpp"
#include "tests/explore/case.hpp"
#include "tests/explore/explorer.hpp"
#include "tests/explore/image.hpp"
#include "tests/shm/table_builder.hpp"

namespace arbiter::explore {

using shm::SourceId;
inline constexpr SourceId kA = 0, kB = 1, kC = 2, kSources = 3;
inline constexpr shm::PortId kPort = 0, kOther = 1, kPorts = 2;

struct Input;

// An output port. A sample says which it is, counted by the port.
struct Output {
  Outcome publish();
  // The same with a loan whose bytes are written where anybody but `own` may read them.
  Outcome publish_known_to(const Input& own);
  Outcome signal() { return core->signal(shm::monotonic_now()); }
  void deactivate() { core->deactivate(shm::monotonic_now()); }
  // From now on its samples are written where the last one was, as large ones are.
  void publish_as_large() const { core->smallest_large = 0; }
  // Takes up what the service thread has offered.
  void settle() { static_cast<void>(core->loan(sizeof published)); }
  [[nodiscard]] const shm::OutputCounters& counters() const;

  std::shared_ptr<detail::SharedMemory> memory;
  std::unique_ptr<detail::OutputCore> core;
  shm::Mapping mapping;
  std::uint64_t published = 0;
  std::uint64_t delivered = 0;  // the sum of what publish() said, as the next two
  std::uint64_t discarded = 0;
  std::uint64_t refused = 0;
};

// An input port, and what it has taken.
struct Input {
  // Takes and reads a sample and gives it back; false: there was none.
  bool take();
  // The same without reading it.
  bool take_unread();
  // Takes and reads a sample, and keeps it.
  detail::HeldSample hold();
  // Reads it once more: it must be as it was.
  void read_again(const detail::HeldSample& sample) const;
  // As take(), of what the wait has brought.
  detail::Waited wait(shm::Nanoseconds timeout = shm::kForever);

  [[nodiscard]] const shm::InputCounters& counters() const;
  [[nodiscard]] std::uint64_t taken_of_all() const;

  std::shared_ptr<detail::SharedMemory> memory;
  std::unique_ptr<detail::InputCore> core;
  shm::PortId port = shm::kNone;
  shm::Mapping mapping;
  std::uint64_t taken[kSources] = {};
  std::uint64_t last[kSources] = {};
  shm::Nanoseconds last_stamp = 0;

 private:
  void note(const detail::HeldSample& sample);
};

// A tap, and what it has seen.
struct Watcher {
  // Takes an event, and reads its sample; false: there was none.
  bool take();
  // As take(), of what the wait has brought.
  bool wait();

  std::unique_ptr<detail::TapCore> core;
  std::uint64_t seen = 0;      // samples
  std::uint64_t accepted = 0;  // of them, at any port
  std::uint64_t lost = 0;
  std::uint64_t last = 0;

 private:
  bool note(const detail::TapEventData& event);
};

// What belongs to one instance of Arbiter. Its ports see the pages of all sources.
class Instance {
 public:
  explicit Instance(const test::TableBuilder& model);

  // With room for `slots` samples; 0: for as many as are needed at worst, and no more.
  std::unique_ptr<Output> make_output(std::uint32_t slots = 0, std::uint32_t max_loans = 0);
  std::unique_ptr<Input> make_input(shm::PortId port, const InputPortOptions& options);
  // The port is open from here on: it may write its source's activity.
  void bind(Output& output, SourceId source);

  // What the service threads do when the daemon has introduced two ports.
  static void tell_output(Output& output, const Input& input, std::uint64_t link);
  static void tell_input(Input& input, const Output& output, std::uint64_t link);
  void connect(Output& output, Input& input);
  // The same of a tap.
  static void tell_tap(Output& output, Watcher& watcher);
  static detail::OutputCore::TapEntry tell_tapped(Output& output, const Watcher& watcher);
  static void tell_watcher(const Output& output, Watcher& watcher,
                           const detail::OutputCore::TapEntry& entry);
  std::unique_ptr<Watcher> make_watcher(const TapOptions& options);

  // As the daemon does it: writes a model's table behind the one in force, and puts it in force.
  void prepare(const test::TableBuilder& model);
  void put_in_force();
  // The same when a source passes to another user: its next page is made, shown to those who read
  // the source, and put in force; from then on it is the one that bind() gives.
  void make_next_page(SourceId source);
  void show_next_page(SourceId source, detail::SharedMemory& memory) const;
  void change_page(SourceId source);
  [[nodiscard]] shm::Activity& activity(SourceId source) const {
    return page_mappings_[source].as<shm::ActivityPage>()->of(source);
  }

 private:
  std::shared_ptr<detail::SharedMemory> make_memory();

  shm::FileDescriptor board_;
  shm::Mapping board_mapping_;
  std::vector<shm::FileDescriptor> pages_;
  std::vector<shm::Mapping> page_mappings_;
  int next_page_ = -1;  // the descriptor that it is known by, whether it is in force or not
  shm::Mapping next_mapping_;
  shm::PortInstance next_instance_ = 1;
  std::uint64_t next_link_ = 1;
};

// A model in which activity has no end of itself.
test::TableBuilder forever();

// Options of a port with queues of that depth.
InputPortOptions depth(std::uint32_t samples);

// An input port and the output ports of all sources. Some are connected to it; it sees the activity
// of all, and they see whether it waits.
struct Scene {
  Scene(const test::TableBuilder& model, const InputPortOptions& options,
        std::initializer_list<SourceId> connected);

  Output& a() { return *outputs[kA]; }
  Output& b() { return *outputs[kB]; }
  Output& c() { return *outputs[kC]; }
  // Takes what is there; then each sample that was delivered must be accounted for.
  void drain();

  Instance instance;
  std::unique_ptr<Output> outputs[kSources];
  std::unique_ptr<Input> input;
  shm::Atomic<std::uint32_t> returned{0};  // what a thread tells the others once a call is back
};

// Explores with a scene of its own for each execution.
template <class World, class... Arguments>
void explore_anew(const Explore& explore, std::function<void(World&, Execution&)> scenario,
                  Arguments&&... arguments) {
  Restored<World> world(std::forward<Arguments>(arguments)...);
  explore([&](Execution& execution) { scenario(world.restore(), execution); });
}

}  // namespace arbiter::explore
