// A program that speaks iceoryx and nothing else: obeys speeds, and stops where none comes.
#include <chrono>
#include <iostream>
#include <thread>

#include <iceoryx_hoofs/posix_wrapper/signal_watcher.hpp>
#include <iceoryx_posh/popo/subscriber.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

#include "speed.hpp"

int main() {
  iox::runtime::PoshRuntime::initRuntime("base");
  iox::popo::SubscriberOptions options;
  options.queueCapacity = 1;  // the latest counts
  iox::popo::Subscriber<Speed> subscriber({"Base", "Main", "Speed"}, options);
  double driving = -1;
  const auto drive = [&](double speed, const char* why) {
    if (speed == driving) return;
    driving = speed;
    std::cout << "speed " << speed << why << std::endl;
  };
  int silent = 0;
  while (!iox::posix::hasTerminationRequested()) {
    subscriber.take()
        .and_then([&](const auto& sample) {
          silent = 0;
          drive(sample->forward, "");
        })
        .or_else([&](auto&) {
          // Whatever stands between the commander and a motor: the motor has a time-out of its own.
          if (++silent == 50) drive(0, ": nothing has come for half a second");
        });
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return 0;
}
