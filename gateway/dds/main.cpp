// arbiter-gateway-dds: topics of DDS and ROS 2 through the ports of Arbiter (docs/dds.md).
#include <memory>

#include "gateway/core/program.hpp"
#include "gateway/dds/dds_middleware.hpp"
#include "gateway/dds/freed_memory.hpp"
#include "gateway/dds/latched_samples.hpp"

int main(int argc, char** argv) {
  using namespace arbiter;
  gateway::dds::keep_freed_memory();
  const gateway::ProgramKind kind{
      gateway::Kind::kDds, "arbiter-gateway-dds",
      "Passes topics of DDS and ROS 2 through the ports of Arbiter.",
      "The domain is the mapping's, or ROS_DOMAIN_ID, or 0. Cyclone DDS reads CYCLONEDDS_URI.\n"
      "Example:\n"
      "  arbiter-gateway-dds /etc/arbiter/ros2.xml"};
  gateway::dds::LatchedSamples latched;
  return gateway::run_program(
      argc, argv, kind, [&](const gateway::Settings& settings, const gateway::Bell& bell) {
        return std::make_unique<gateway::dds::DdsMiddleware>(settings.mappings, bell, latched);
      });
}
