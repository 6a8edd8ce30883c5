// A publisher that takes its own samples, and whose bytes are written only where others read them.
#include "tests/explore/components.hpp"

namespace arbiter::explore::late_bytes_cases {
namespace {

test::TableBuilder everything() {
  return forever()
      .connect({kA, kPort, shm::table::kAlways, {}, {}})
      .connect({kA, kOther, shm::table::kAlways, {}, {}});
}

TapOptions polling() {
  TapOptions options;
  options.may_wait = false;
  return options;
}

// Its slots have gone round: what was not written is an older sample. A tap has been there, so that
// there is memory for what taps are told.
struct Alone : Scene {
  Alone()
      : Scene(everything(), depth(1), {}),
        own(instance.make_input(kOther, depth(1))),
        watcher(instance.make_watcher(polling())) {
    outputs[kA] = instance.make_output(0, 1);
    instance.bind(a(), kA);
    Instance::tell_output(a(), *input, 0);
    instance.connect(a(), *own);
    const auto before = instance.make_watcher(polling());
    Instance::tell_tap(a(), *before);
    pass_on();
    a().core->remove_tap(before->core->instance());
    for (int i = 0; i < 4; ++i) pass_on();
  }
  void pass_on() {
    a().publish_known_to(*own);
    require(own->take_unread(), "its own sample did not come back");
  }

  std::unique_ptr<Input> own;
  std::unique_ptr<Watcher> watcher;
};

void join(const Explore& explore) {
  explore_anew<Alone>(explore, [](Alone& scene, Execution& execution) {
    execution.mortal_thread([&scene] {
      Instance::tell_output(scene.a(), *scene.input, 9);
      Instance::tell_input(*scene.input, scene.a(), 9);
    });
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.pass_on();
    });
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.input->take();
    });
    execution.finally([&scene] {
      if (Explorer::running()->is_halted(0)) return;
      scene.pass_on();
      while (scene.input->take()) {
      }
      require(scene.input->last[kA] == scene.a().published, "a receiver that joined has no queue");
    });
  });
}
const Register kJoin("AReceiverThatJoinsReadsNoBytesThatNobodyHasWritten", {2, 2, 1}, join);

void tap(const Explore& explore) {
  explore_anew<Alone>(explore, [](Alone& scene, Execution& execution) {
    execution.thread([&scene] { Instance::tell_tap(scene.a(), *scene.watcher); });
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.pass_on();
    });
    execution.mortal_thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.watcher->take();
    });
    execution.finally([&scene] {
      scene.pass_on();
      if (Explorer::running()->is_halted(2)) return;
      while (scene.watcher->take()) {
      }
      require(scene.watcher->last == scene.a().published, "the last sample was not told");
    });
  });
}
const Register kTap("ATapThatJoinsReadsNoBytesThatNobodyHasWritten", {2, 1, 1}, tap);

}  // namespace
}  // namespace arbiter::explore::late_bytes_cases
