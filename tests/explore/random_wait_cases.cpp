// What an armed descriptor and wait_for() say, over random sequences of all that a port and its
// sources do, beside a meaning of the rules that shares nothing with the ports.
#include <array>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "tests/explore/components.hpp"
#include "tests/explore/kernel.hpp"

namespace arbiter::explore::random_wait_cases {
namespace {

using detail::Waited;
using IsActive = std::function<bool(SourceId)>;

struct Model {
  test::TableBuilder table;
  std::function<SourceId(const IsActive&)> selected;
};

// Of one connection, that of A, whose rule is a truth table of B and C; and of two that exclude
// each other.
std::vector<Model> models(const std::array<shm::Nanoseconds, kSources>& timeouts) {
  using namespace shm::table;
  test::TableBuilder base;
  for (SourceId id = 0; id < kSources; ++id) base.timeout(id, timeouts[id]);
  std::vector<Model> all;
  for (unsigned truth = 0; truth < 16; ++truth) {
    const auto leaf = [truth](unsigned b, unsigned c) {
      return (truth >> (2 * b + c) & 1) != 0 ? kTrue : kFalse;
    };
    auto table = base;
    table.connect({kA,
                   kPort,
                   kDiagram,
                   {kB, kC},
                   {0, 1, 2, 1, leaf(0, 0), leaf(0, 1), 1, leaf(1, 0), leaf(1, 1)},
                   0,
                   kTrue});
    all.push_back({table, [truth](const IsActive& is) {
                     const unsigned at = 2 * (is(kB) ? 1 : 0) + (is(kC) ? 1 : 0);
                     return is(kA) && (truth >> at & 1) != 0 ? kA : shm::kNone;
                   }});
  }
  auto table = base;
  table.conjunction(kA, kPort, {}, {kB, kC}).conjunction(kB, kPort, {}, {kC});
  all.push_back({table, [](const IsActive& is) {
                   if (is(kC)) return shm::kNone;
                   return is(kB) ? kB : is(kA) ? kA : shm::kNone;
                 }});
  table = base;
  table.conjunction(kA, kPort, {kC}, {kB}).connect({kB, kPort, kAlways, {}, {}});
  all.push_back({table, [](const IsActive& is) {
                   if (is(kB)) return kB;
                   return is(kA) && is(kC) ? kA : shm::kNone;
                 }});
  return all;
}

struct RandomScene : Scene {
  explicit RandomScene(std::vector<Model> all)
      : Scene(all[0].table, depth(2), {kA, kB}), models(std::move(all)) {
    input->core->wait_descriptor();
  }

  using Words = std::array<shm::ActivityWord, kSources>;
  Words words() const {
    Words all;
    for (SourceId id = 0; id < kSources; ++id) {
      all[id] = instance.activity(id).word.load(std::memory_order_relaxed);
    }
    return all;
  }
  SourceId selected_at(const Words& all, shm::Nanoseconds time) const {
    return models[in_force].selected([&](SourceId id) { return shm::is_active(all[id], time); });
  }
  SourceId selected() const { return selected_at(words(), virtual_time()); }
  SourceId believed() const {
    const auto& header = input->mapping.as<const shm::InputSegment>()->header;
    return header.believed.load(std::memory_order_relaxed);
  }
  bool is_readable() const {
    return is_rung(input->core->bell()) || virtual_time() >= timer_expires_at();
  }

  void swap_model(std::size_t model) {
    instance.prepare(models[model].table);
    instance.put_in_force();
    in_force = model;
    shm::ring_bell(input->core->bell().write_end().get());
  }

  // An event of a source. What it makes of the selection while the descriptor is armed rings.
  void happen(SourceId id, unsigned what) {
    const Words before = words();
    const shm::Nanoseconds start = virtual_time();
    const bool sleeps = armed && !is_readable();
    std::uint64_t delivered = 0;
    if (what < 3) delivered = outputs[id]->publish().delivered;
    if (what == 3) outputs[id]->signal();
    if (what == 4) outputs[id]->deactivate();
    if (!sleeps) return;
    const Words after = words();
    const auto changes_at = [&](shm::Nanoseconds time) {
      const SourceId selected = selected_at(after, time);
      return selected != selected_at(before, time) && selected != believed();
    };
    const bool changes = changes_at(start) && changes_at(virtual_time());  // and not time alone
    require(delivered == 0 || is_readable(), "a sample came, and nobody was told");
    require(!changes || is_readable(), "an event was not told");
  }

  // A look by the port: whether it must have seen a commander, or may have.
  void looked(SourceId before, bool took) {
    const SourceId after = selected();
    if (took || (before != shm::kNone && after != shm::kNone)) commanded = 1;
    if (!took && (before == shm::kNone) != (after == shm::kNone) && commanded == 0) commanded = 2;
  }
  void take(bool all) {
    for (;;) {
      const SourceId before = selected();
      const bool took = input->take();
      looked(before, took);
      armed = !took;
      if (!all || !took) return;
    }
  }
  void wait() {
    const SourceId before = selected();
    const Waited waited = input->wait(0);
    armed = false;
    const bool surely_idle = before == shm::kNone && selected() == shm::kNone;
    if (surely_idle && waited != Waited::kSample && commanded != 2) {
      require((waited == Waited::kIdle) == (commanded == 1),
              "idle is told too seldom, or too often");
    }
    if (waited == Waited::kIdle) {
      commanded = 0;
    } else {
      looked(before, waited == Waited::kSample);
    }
  }

  void step(std::mt19937& random) {
    const auto below = [&random](unsigned n) { return static_cast<unsigned>(random() % n); };
    switch (below(9)) {
      case 0:
      case 1:
      case 2:
        return happen(below(kSources), below(5));
      case 3:
        return set_virtual_time(virtual_time() + below(below(4) == 0 ? 400 : 12));
      case 4:
      case 5:
        return take(true);
      case 6:
        if (below(4) != 0) return take(false);
        armed = false;
        return input->core->disarm_descriptor();
      case 7: {
        if (below(2) == 0) return wait();
        const SourceId before = selected();
        const bool idle = input->core->is_idle();
        const SourceId after = selected();
        require(before != after || idle == (after == shm::kNone), "it is idle, or not, wrongly");
        return looked(before, false);
      }
      default:
        if (below(8) == 0) swap_model(below(static_cast<unsigned>(models.size())));
    }
  }

  void check() const {
    if (!armed || is_readable()) return;
    require(believed() == shm::kNone || believed() == selected(),
            "it believes what is no longer so");
  }

  std::vector<Model> models;
  std::size_t in_force = 0;
  bool armed = false;
  int commanded = 0;  // since idle was last told; 2: it is not known
};

void random_sequences(const Explore& explore) {
  for (const unsigned finite : {0U, 1U, 2U, 4U, 3U, 5U, 6U, 7U}) {
    std::array<shm::Nanoseconds, kSources> timeouts{};
    for (SourceId id = 0; id < kSources; ++id) {
      timeouts[id] = (finite >> id & 1) != 0 ? 150 * (id + 1) : shm::kForever;
    }
    explore_anew<RandomScene>(
        explore,
        [finite](RandomScene& scene, Execution& execution) {
          execution.thread([&scene, finite] {
            std::mt19937 random(finite);
            for (int i = 0; i < 40'000; ++i) {
              scene.step(random);
              scene.check();
            }
          });
        },
        models(timeouts));
  }
}
const Register kRandom("AnArmedDescriptorTellsOfAllThatRandomSequencesDo", {0, 0},
                       random_sequences);

}  // namespace
}  // namespace arbiter::explore::random_wait_cases
