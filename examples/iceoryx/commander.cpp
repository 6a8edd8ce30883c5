// A program that speaks iceoryx and nothing else: publishes a speed, twenty times a second.
//
//   commander SERVICE FORWARD
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>

#include <iceoryx_hoofs/posix_wrapper/signal_watcher.hpp>
#include <iceoryx_posh/popo/publisher.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

#include "speed.hpp"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: commander SERVICE FORWARD\n";
    return 2;
  }
  const iox::capro::IdString_t service(iox::cxx::TruncateToCapacity, argv[1]);
  const std::string name = std::string("commander-") + argv[1];
  iox::runtime::PoshRuntime::initRuntime(
      iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name.c_str()));
  iox::popo::Publisher<Speed> publisher({service, "Main", "Speed"});
  while (!iox::posix::hasTerminationRequested()) {
    publisher.publishCopyOf(Speed{std::atof(argv[2]), 0}).or_else([](auto&) {
      std::cerr << "no memory for a speed\n";
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return 0;
}
