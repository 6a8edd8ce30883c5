// arbiter-gateway-iceoryx: programs that speak iceoryx, arbitrated unchanged.
#include "gateway/core/program.hpp"
#include "gateway/iceoryx/iceoryx.hpp"
#include "gateway/iceoryx/runtime.hpp"

namespace {

constexpr const char* kMore =
    "\nExample:\n"
    "  arbiter-gateway-iceoryx radar.xml\n"
    "  arbiter check robot.xml --gateway radar.xml\n"
    "\nwhere radar.xml is\n"
    "  <gateway kind=\"iceoryx\">\n"
    "    <in service=\"Radar\" instance=\"Front\" event=\"Objects\" port=\"/Radar/objects:o\"/>\n"
    "    <out port=\"/Brake:i\" service=\"Brake\" instance=\"All\" event=\"Force\" size=\"8\" "
    "idle=\"zero\"/>\n"
    "  </gateway>\n"
    "\nIt needs RouDi (iox-roudi), and waits for it. What uses iceoryx is a process of its own, "
    "which is\n"
    "started again when RouDi goes. A gateway that has waited for longer than a source's T passes "
    "nothing\n"
    "on that is as old.\n";

}  // namespace

int main(int argc, char** argv) {
  using namespace arbiter::gateway;
  const std::string name = "arbiter-gateway-iceoryx";
  const ProgramKind kind{
      Kind::kIceoryx, name, name + ": passes topics of iceoryx in and out of Arbiter",
      kMore,          true, [&](int pid) { remove_traces(runtime_name(name, pid)); }};
  return run_program(argc, argv, kind, [](const Settings& settings, const Bell&) {
    return std::make_unique<Iceoryx>(settings.bridge.name);
  });
}
