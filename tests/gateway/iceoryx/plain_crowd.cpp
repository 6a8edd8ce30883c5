// A program of iceoryx that leaves RouDi no publisher for anybody else, until it is
// killed. Says "ready" when it has them all.
#include <unistd.h>

#include <iostream>
#include <string>

#include <iceoryx_hoofs/error_handling/error_handling.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

int main() {
  const auto handler = iox::ErrorHandler::setTemporaryErrorHandler(
      [](iox::Error, const std::function<void()>&, iox::ErrorLevel) {});
  const std::string name = "plain-crowd-" + std::to_string(::getpid());
  auto& runtime = iox::runtime::PoshRuntime::initRuntime(
      iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name.c_str()));
  for (int i = 0;; ++i) {
    const std::string event = std::to_string(i);
    const iox::capro::IdString_t id(iox::cxx::TruncateToCapacity, event);
    if (runtime.getMiddlewarePublisher({"Crowd", "One", id}) == nullptr) break;
  }
  std::cout << "ready" << std::endl;
  for (;;) ::pause();
}
