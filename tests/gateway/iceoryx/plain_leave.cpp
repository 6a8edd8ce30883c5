// Tells RouDi that a program ends, which goes on: RouDi gives it up, as it does with one that it
// has not heard of for a while, and tells it as little.
//
//   plain_leave RUNTIME
#include <iceoryx_posh/iceoryx_posh_types.hpp>
#include <iceoryx_posh/internal/runtime/ipc_interface_user.hpp>

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  using iox::runtime::IpcMessageType;
  iox::runtime::IpcInterfaceUser roudi(iox::roudi::IPC_CHANNEL_ROUDI_NAME);
  iox::runtime::IpcMessage message;
  message << iox::runtime::IpcMessageTypeToString(IpcMessageType::TERMINATION) << argv[1];
  return roudi.send(message) ? 0 : 1;
}
