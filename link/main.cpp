// arbiter-link: joins this host's daemon with those of other hosts (docs/hosts.md).
#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#include <systemd/sd-daemon.h>

#include <chrono>
#include <cstdint>
#include <exception>
#include <future>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "command_line/durations.hpp"
#include "command_line/standard_streams.hpp"
#include "command_line/values.hpp"
#include "command_line/wrong_use.hpp"
#include "gateway/core/say.hpp"
#include "gateway/core/stop_signals.hpp"
#include "gateway/dds/peer_watch.hpp"
#include "link/link.hpp"
#include "rules/text/names.hpp"
#include "shm/file_descriptor.hpp"
#include "shm/utf8.hpp"
#include "watch/machine.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::link {
namespace {

constexpr std::uint32_t kMaxDomain = 230;  // above it there are no ports
constexpr int kWrongUse = 2;

// Throws CLI::ValidationError.
shm::Nanoseconds read_max_age(const std::string& text) {
  const shm::Nanoseconds age = command_line::read_time_above_zero("--max-age", text);
  if (age == shm::kForever) {
    throw CLI::ValidationError("--max-age",
                               std::string("may not be forever; ") + command_line::kTimeAdvice);
  }
  return age;
}

// Throws CLI::ValidationError.
void require_host_name(const std::string& host) {
  if (shm::is_host_name(host)) return;
  throw CLI::ValidationError("--host", "\"" + host + "\" is not a host name: use 1 to " +
                                           std::to_string(shm::kMaxHostName) +
                                           " letters, digits, dots, hyphens and underscores");
}

// Throws CLI::ValidationError.
void require_interfaces(const std::vector<std::string>& interfaces) {
  std::set<std::string> seen;
  for (const std::string& each : interfaces) {
    if (each.empty()) {
      throw CLI::ValidationError("--interface",
                                 "is empty: name a network interface, such as eth0, or leave it "
                                 "out, so that nothing leaves this machine");
    }
    in6_addr ignored{};
    if (inet_pton(AF_INET6, each.substr(0, each.find('%')).c_str(), &ignored) == 1) {
      throw CLI::ValidationError("--interface",
                                 rules::quote(each) +
                                     " is an address of IPv6, and links talk by IPv4: write the "
                                     "name of the interface, such as eth0, or its IPv4 address");
    }
    if (!seen.insert(each).second) {
      throw CLI::ValidationError("--interface",
                                 "names " + rules::quote(each) + " twice: once is enough");
    }
  }
}

bool is_port(const std::string& text) {
  constexpr std::size_t kMostDigits = 5;
  return !text.empty() && text.size() <= kMostDigits &&
         text.find_first_not_of("0123456789") == std::string::npos && std::stoi(text) > 0 &&
         std::stoi(text) <= UINT16_MAX;
}

// Why no address of it is known that links can use: an error of getaddrinfo(); 0: one is. DDS takes
// ADDRESS:PORT, too.
int find_no_address(const std::string& peer) {
  const std::string host = gateway::dds::host_of_peer(peer);
  if (host.size() != peer.size() && !is_port(peer.substr(host.size() + 1))) return EAI_NONAME;
  return host.empty() ? EAI_NONAME : gateway::dds::look_up(host).error;
}

// Throws CLI::ValidationError. A name server that cannot be asked now is no wrong use: the network
// may come later than the link.
void require_peers(const NetworkOptions& network) {
  if (network.peers.empty()) return;
  if (network.interfaces.empty()) {
    throw CLI::ValidationError("--peer",
                               "leads nowhere without an --interface, for then nothing leaves this "
                               "machine; name the network interface that leads to " +
                                   network.peers.front() + ", such as --interface eth0");
  }
  for (const std::string& peer : network.peers) {
    const int error = find_no_address(peer);
    if (error == 0) continue;
    const std::string about = rules::quote(peer);
    if (error == EAI_NONAME || error == EAI_ADDRFAMILY || error == EAI_NODATA) {
      throw CLI::ValidationError("--peer",
                                 about +
                                     " is neither an IPv4 address nor the name of a host of which "
                                     "this machine knows one; links talk by IPv4: write its "
                                     "address, such as 192.168.1.12, or put the name into "
                                     "/etc/hosts");
    }
    gateway::say(
        gateway::Level::kWarning,
        "the address of --peer " + about + " cannot be found out now (" + gai_strerror(error) +
            "), so that this host is not looked for there until it can; write its address, "
            "or put the name into /etc/hosts");
  }
}

struct CommandLine {
  LinkOptions options;
  std::string max_age;

  void describe(CLI::App& app);
  // Throws CLI::ValidationError, and std::invalid_argument.
  void judge();
};

void CommandLine::describe(CLI::App& app) {
  app.set_version_flag("--version", std::string("arbiter-link ") + ARBITER_VERSION);
  app.add_option(
         "--instance", options.instance,
         "Name of the daemon; by default $ARBITER_INSTANCE, or \"default\" if that is not set")
      ->type_name("NAME");
  app.add_option("--host", options.host,
                 "The name of this host for the others; by default its host name")
      ->type_name("NAME");
  app.add_option(
         "--interface", options.network.interfaces,
         "A network interface, by name or IPv4 address (repeatable); without it nothing leaves "
         "this machine")
      ->type_name("NAME|ADDRESS");
  app.add_option("--peer", options.network.peers,
                 "The address of a host that multicast does not reach (repeatable); it needs an "
                 "--interface")
      ->type_name("ADDRESS");
  app.add_option("--domain", options.network.domain,
                 "The domain of DDS, the same on all hosts (default " +
                     std::to_string(options.network.domain) + ")")
      ->type_name("N")
      ->check(command_line::whole_number_between(0, kMaxDomain));
  app.add_option(
         "--security", options.network.security,
         "A folder with the keys for DDS Security: HOST.pem, HOST_key.pem, identity_ca.pem, "
         "permissions_ca.pem, governance.p7s, permissions.p7s")
      ->type_name("FOLDER")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""));
  app.add_option("--max-age", max_age,
                 "How old a sample may be when it arrives, such as 100ms: where T is forever, or "
                 "longer than that; by default T, or for forever the model's timeout")
      ->type_name("DURATION");
  app.footer(
      "Example:\n  arbiter-link --interface eth0\n\n"
      "Exit codes: 0 ended by SIGINT or SIGTERM; 1 an error; 2 wrong use");
  command_line::refuse_empty(app, {"--interface"});  // require_interfaces() has its own words
  app.failure_message(command_line::wrong_use_text);
}

void CommandLine::judge() {
  options.instance = wire::instance_name(options.instance);
  require_host_name(options.host);
  require_interfaces(options.network.interfaces);
  require_peers(options.network);
  if (!max_age.empty()) options.max_age = read_max_age(max_age);
  options.network.name = options.host;
}

// One link after the other, until a signal comes.
void serve(const LinkOptions& options, const shm::FileDescriptor& stop) {
  // A program that waits for an answer does not hold up the next link.
  std::vector<std::future<void>> closing;
  Neighbours known;
  gateway::dds::PeerWatch peers(options.network.peers);
  for (bool is_first = true;; is_first = false) {
    Link link(options, peers, std::move(known));
    if (is_first) sd_notify(0, "READY=1");
    if (link.run(stop.get()) == Link::End::kStopped) return;
    std::erase_if(closing, [](const std::future<void>& each) {
      return each.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    });
    auto desk = link.take_desk();
    known = desk->known();
    closing.push_back(
        std::async(std::launch::async, [desk = std::move(desk)]() mutable { desk.reset(); }));
  }
}

int run(int argc, char** argv) {
  gateway::set_program_name("arbiter-link");
  CLI::App app("Joins the Arbiter of this host with those of other hosts.", "arbiter-link");
  CommandLine line;
  line.options.host = watch::host_name();
  line.options.version = ARBITER_VERSION;
  line.options.on_round = [] { sd_notify(0, "WATCHDOG=1"); };
  line.describe(app);
  try {
    app.parse(argc, argv);
    line.judge();
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    app.exit(error);
    return kWrongUse;
  } catch (const std::invalid_argument& error) {
    gateway::say(gateway::Level::kError, error.what());
    return kWrongUse;
  }
  serve(line.options, gateway::catch_stop_signals());
  return 0;
}

}  // namespace
}  // namespace arbiter::link

int main(int argc, char** argv) {
  if (!arbiter::command_line::open_standard_streams()) return 1;
  try {
    return arbiter::link::run(argc, argv);
  } catch (const std::exception& error) {
    arbiter::gateway::say(arbiter::gateway::Level::kError, error.what());
    return 1;
  }
}
