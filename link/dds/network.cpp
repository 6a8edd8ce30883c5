#include "link/dds/network.hpp"

#include "gateway/dds/domain.hpp"

namespace arbiter::link {
namespace {

// MaxMessageSize: datagrams that no network cuts into pieces. Of a datagram that IP has cut, one
// lost piece loses the whole and jams reassembly; DDS repeats what it has cut itself.
// LeaseDuration: a host that is silent for so long is gone. A link that is starved for longer is
// taken for dead, and comes back.
// SPDPInterval: a host that was cut off is found again within that time.
constexpr const char* kForAll =
    "<General><MaxMessageSize>1400B</MaxMessageSize><FragmentSize>1300B</FragmentSize></General>"
    "<Discovery><LeaseDuration>1500ms</LeaseDuration><SPDPInterval>250ms</SPDPInterval></"
    "Discovery>";

}  // namespace

std::string configuration_of(const NetworkOptions& options) {
  gateway::Gateway gateway;
  gateway.interfaces = options.interfaces;
  if (gateway.interfaces.empty()) gateway.interfaces.emplace_back("lo");
  gateway.peers = options.peers;
  return std::string(kForAll) + "," + gateway::dds::configuration_of(gateway);
}

Network::Network(const NetworkOptions& options)
    : domain_(dds_create_domain(options.domain, configuration_of(options).c_str()),
              "DDS domain " + std::to_string(options.domain)),
      participant_(dds_create_participant(options.domain, nullptr, nullptr),
                   "a participant in DDS domain " + std::to_string(options.domain)) {}

}  // namespace arbiter::link
