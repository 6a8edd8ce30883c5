// A component that kills itself at a point of what it is told to do.
//
//   kill_victim PHASE N     prints "ready", reads a line, does it, dies at point N of it
//
// If it comes through it prints "unharmed", and stays until its input ends. It has the output port
// /victim:o and the input port /victim:i, where the phase does not open them itself; and in some
// phases a tap of /first:o.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/kill/number.hpp"
#include "tests/kill/points.hpp"

namespace {

using namespace std::chrono_literals;

using arbiter::test::make_number;
using arbiter::test::Number;

void say(const char* text) {
  std::printf("%s\n", text);
  std::fflush(stdout);
}

void wait_for_line() {
  for (int c = 0; c != '\n';) {
    c = std::getchar();
    if (c == EOF) std::exit(0);
  }
}

class Victim {
 public:
  explicit Victim(std::uint64_t fatal) : fatal_(fatal) {}

  void run(const std::string& phase) {
    const auto what = phases().find(phase);
    if (what == phases().end()) std::exit(2);
    const bool alone = phase == "join" || phase == "meet" || phase.rfind("open", 0) == 0;
    node_.emplace("victim");
    if (phase != "open-output") open_output();
    if (phase != "open-input") open_input();
    // The first calls take up the view of the peers; then all is as it will stay.
    if (!alone) {
      out_->deactivate();
      static_cast<void>(in_->take());
    }
    what->second(*this);
    arbiter::kill::disarm();
    say("unharmed");
    wait_for_line();
  }

 private:
  using Phase = std::function<void(Victim&)>;

  void open_output() { out_.emplace(node_->output_port<Number>("/victim:o", {.max_loans = 1})); }
  void open_tap() { tap_.emplace(node_->tap<Number>("/first:o", {.max_held = 2})); }
  void open_input() {
    in_.emplace(node_->input_port<Number>("/victim:i", {.depth = 2, .max_held = 2}));
  }
  // What comes after this is where it dies.
  void begin(bool all_threads = false) {
    say("ready");
    wait_for_line();
    if (all_threads) {
      arbiter::kill::arm_all_threads(fatal_);
    } else {
      arbiter::kill::arm_this_thread(fatal_);
    }
  }
  void publish(int times = 1) {
    for (; times != 0; --times) static_cast<void>(out_->publish(make_number(1000)));
  }

  static const std::map<std::string, Phase>& phases() {
    static const std::map<std::string, Phase> all{
        {"meet",
         [](Victim& v) {
           v.in_.reset();
           v.out_.reset();
           v.node_.reset();
           v.begin(true);
           v.node_.emplace("victim");
         }},
        {"open-output", [](Victim& v) { v.begin(true), v.open_output(); }},
        {"open-input", [](Victim& v) { v.begin(true), v.open_input(); }},
        {"close-output",
         [](Victim& v) {
           v.publish();
           v.begin(true);
           v.out_.reset();
         }},
        {"close-input", [](Victim& v) { v.begin(true), v.in_.reset(); }},
        {"join",
         [](Victim& v) {
           v.begin();
           v.publish();
           static_cast<void>(v.in_->take());
         }},
        {"publish", [](Victim& v) { v.begin(), v.publish(); }},
        {"publish-loan",
         [](Victim& v) {
           v.begin();
           auto loan = v.out_->loan();
           **loan = make_number(1000);
           static_cast<void>(v.out_->publish(std::move(*loan)));
         }},
        {"publish-overtaking",
         [](Victim& v) {
           v.publish(3);
           v.begin();
           v.publish(3);
         }},
        {"signal", [](Victim& v) { v.begin(), static_cast<void>(v.out_->signal()); }},
        {"deactivate", [](Victim& v) { v.publish(), v.begin(), v.out_->deactivate(); }},
        {"take", [](Victim& v) { v.begin(), static_cast<void>(v.in_->take()); }},
        {"take-and-hold",
         [](Victim& v) {
           v.begin();
           auto one = v.in_->take();
           auto two = v.in_->take();
           one.reset();
           auto three = v.in_->take();
         }},
        {"wait", [](Victim& v) { v.begin(), static_cast<void>(v.in_->wait_for(10s)); }},
        {"wait-in-vain", [](Victim& v) { v.begin(), static_cast<void>(v.in_->wait_for(1ms)); }},
        {"descriptor",
         [](Victim& v) {
           v.begin();
           static_cast<void>(v.in_->fd());
           while (v.in_->take()) {
           }
         }},
        // Until the service thread has mapped and offered what it heard of.
        {"open-tap",
         [](Victim& v) {
           v.begin(true);
           v.open_tap();
           say("open");
           static_cast<void>(v.tap_->wait_for(10s));
         }},
        {"close-tap",
         [](Victim& v) {
           v.open_tap();
           v.begin(true);
           static_cast<void>(v.tap_->take());
           v.tap_.reset();
         }},
        {"take-events",
         [](Victim& v) {
           v.open_tap();
           v.begin();
           static_cast<void>(v.tap_->take());  // the state
           auto one = v.tap_->take();
           auto two = v.tap_->take();
           one.reset();
           auto three = v.tap_->take();
         }},
        {"wait-for-events",
         [](Victim& v) {
           v.open_tap();
           static_cast<void>(v.tap_->take());
           v.begin();
           static_cast<void>(v.tap_->wait_for(10s));
         }},
        {"relay",
         [](Victim& v) {
           v.begin();
           auto sample = v.in_->take();
           auto loan = v.out_->loan();
           **loan = **sample;
           static_cast<void>(v.out_->publish(std::move(*loan)));
         }},
    };
    return all;
  }

  const std::uint64_t fatal_;
  std::optional<arbiter::Node> node_;
  std::optional<arbiter::OutputPort<Number>> out_;
  std::optional<arbiter::InputPort<Number>> in_;
  std::optional<arbiter::Tap<Number>> tap_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  try {
    Victim(std::strtoull(argv[2], nullptr, 10)).run(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "the victim: %s\n", error.what());
    return 1;
  }
  return 0;
}
