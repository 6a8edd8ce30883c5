// A program of iceoryx that dies in the middle of publishing: it leaves a lock behind, for which
// RouDi waits for ever when it clears up.
//
//   plain_lock SERVICE INSTANCE EVENT
#include <unistd.h>

#include <string>

#include <iceoryx_posh/internal/popo/ports/publisher_port_data.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

namespace {

iox::capro::IdString_t id(const char* text) {
  return iox::capro::IdString_t(iox::cxx::TruncateToCapacity, text);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const std::string name = "plain-lock-" + std::to_string(::getpid());
  auto& runtime = iox::runtime::PoshRuntime::initRuntime(
      iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name.c_str()));
  auto* const port = runtime.getMiddlewarePublisher({id(argv[1]), id(argv[2]), id(argv[3])});
  if (port == nullptr) return 1;
  port->m_chunkSenderData.lock();
  ::_exit(0);
}
