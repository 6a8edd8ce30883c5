#include "link/dds/network.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <future>
#include <iterator>
#include <system_error>
#include <utility>

#include "gateway/dds/domain.hpp"
#include "link/core/event_header.hpp"
#include "link/dds/host_search.hpp"
#include "link/dds/security.hpp"

namespace arbiter::link {
namespace {

// MaxMessageSize: datagrams that no network cuts into pieces. Of a datagram that IP has cut, one
// lost piece loses the whole and jams reassembly; DDS repeats what it has cut itself.
// LeaseDuration: a host that is silent for so long is gone. A link that is starved for longer is
// taken for dead, and comes back.
// SPDPInterval: a host that was cut off is found again within that time.
// HeartbeatInterval, AutoReschedNackDelay: what a network has lost is asked for again within that
// time. By default a writer that is not answered asks less and less often, at last every 8 s, and a
// reader that is not waits for 3 s; discovery is several such conversations, one after another.
// WriterLingerDuration: for so long at most the end of a source waits for hosts that do not
// acknowledge; that it has ended, they learn from discovery.
// MaxSampleSize: what a stranger says that it sends is not held until it is whole and can be
// judged. The largest sample crosses, with its header (core/event_header.hpp) and what DDS adds;
// answers and cards are smaller.
constexpr std::size_t kMaxBytes = kMaxSampleBytes + 4096;
static_assert(kMaxSampleBytes + kMaxHeaderBytes < kMaxBytes);

constexpr const char* kForAll =
    "<General><MaxMessageSize>1400B</MaxMessageSize><FragmentSize>1300B</FragmentSize></General>"
    "<Internal><SocketReceiveBufferSize max=\"8MiB\"/></Internal>"
    "<Discovery><LeaseDuration>1500ms</LeaseDuration><SPDPInterval>250ms</SPDPInterval></"
    "Discovery><Internal><HeartbeatInterval max=\"500ms\">100ms</HeartbeatInterval>"
    "<AutoReschedNackDelay>500ms</AutoReschedNackDelay>"
    "<WriterLingerDuration>100ms</WriterLingerDuration></Internal>";

// With its address, Cyclone ends within it, but for samples that nobody acknowledges.
constexpr std::chrono::milliseconds kEndsWithin{1000};
// Without it: for what goes before its threads. Once they are woken they do not rest until they
// end.
constexpr std::chrono::milliseconds kEndsCutOffWithin{50};

// This process's, in order. Where they cannot be listed: none.
std::vector<int> datagram_sockets() {
  std::vector<int> sockets;
  std::error_code error;
  std::filesystem::directory_iterator each("/proc/self/fd", error);
  for (; !error && each != std::filesystem::directory_iterator(); each.increment(error)) {
    const int fd = std::atoi(each->path().filename().c_str());
    int domain = 0;
    int type = 0;
    socklen_t size = sizeof domain;
    if (::getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0) continue;
    size = sizeof type;
    if (::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0) continue;
    if ((domain == AF_INET || domain == AF_INET6) && type == SOCK_DGRAM) sockets.push_back(fd);
  }
  std::sort(sockets.begin(), sockets.end());
  return sockets;
}

}  // namespace

std::string configuration_of(const NetworkOptions& options) {
  gateway::Gateway gateway;
  gateway.interfaces = options.interfaces;
  if (gateway.interfaces.empty()) gateway.interfaces.emplace_back("lo");
  gateway.peers = options.peers;
  std::string all = kForAll;
  all += "<Internal><MaxSampleSize>" + std::to_string(kMaxBytes) + "B</MaxSampleSize></Internal>,";
  all += gateway::dds::configuration_of(gateway, "");  // no file
  if (!options.security.empty()) {
    all += "," + security_configuration(options.security, options.name);
  }
  return all;
}

Domain::Domain(const NetworkOptions& options) {
  if (!options.peers.empty()) HostSearch::of_process().begin(options.domain);
  const std::vector<int> before = datagram_sockets();
  entity_ = Entity(dds_create_domain(options.domain, configuration_of(options).c_str()),
                   "DDS domain " + std::to_string(options.domain));
  const std::vector<int> now = datagram_sockets();
  std::vector<int> made;
  std::set_difference(now.begin(), now.end(), before.begin(), before.end(),
                      std::back_inserter(made));
  for (const int socket : made) {
    shm::FileDescriptor own = shm::duplicate(socket);
    if (own) sockets_.push_back(std::move(own));
  }
}

Domain::~Domain() {
  std::promise<void> deleted;  // the address may go even now
  std::future<void> watch;
  try {
    watch = std::async(std::launch::async, [this, over = deleted.get_future()] {
      const auto within = is_cut_off_ ? kEndsCutOffWithin : kEndsWithin;
      if (over.wait_for(within) == std::future_status::timeout) wake_receivers();
    });
  } catch (const std::exception&) {  // there is no thread to be had
    wake_receivers();
  }
  entity_ = Entity();
  deleted.set_value();
}

void Domain::wake_receivers() const noexcept {
  for (const auto& socket : sockets_) static_cast<void>(::shutdown(socket.get(), SHUT_RD));
}

Network::Network(const NetworkOptions& options)
    : domain_(options),
      participant_(dds_create_participant(options.domain, nullptr, nullptr),
                   "a participant in DDS domain " + std::to_string(options.domain)) {}

}  // namespace arbiter::link
