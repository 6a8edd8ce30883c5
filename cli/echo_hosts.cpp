#include "cli/echo_hosts.hpp"

#include <chrono>
#include <exception>
#include <sstream>

#include "cli/live.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"
#include "watch/imported.hpp"

namespace arbiter::cli {
namespace {

// A link says a little later what it has opened.
constexpr shm::Nanoseconds kAskAgain = 100'000'000;
// There may be no daemon, or a policy that does not let us ask.
constexpr shm::Nanoseconds kAskAgainInVain = 2'000'000'000;
// Arrivals wait meanwhile.
constexpr std::chrono::milliseconds kHostPatience{100};
constexpr std::chrono::milliseconds kHostAnswerTime{1000};

}  // namespace

std::string EchoHosts::text(const std::string& source, const Origin& origin) {
  if (origin.publisher == 0) return {};
  const std::string& host = host_of(source, origin);
  return " (" + (host.empty() ? "there" : "host " + shm::printable(host)) + " #" +
         std::to_string(origin.sequence) + ')';
}

nlohmann::json EchoHosts::json_of(const std::string& source, const Origin& origin) {
  std::ostringstream publisher;
  publisher << std::hex << origin.publisher;
  nlohmann::json json{{"publisher", publisher.str()}, {"sequence", origin.sequence}};
  const std::string& host = host_of(source, origin);
  if (!host.empty()) json["host"] = host;
  return json;
}

const std::string& EchoHosts::host_of(const std::string& source, const Origin& origin) {
  Known& known = known_[source];
  if (known.publisher != origin.publisher) known = {origin.publisher, false, {}};
  if (!known.is_said && shm::monotonic_now() >= ask_again_) ask();
  return known.host;
}

void EchoHosts::ask() {
  wire::Caller asker = caller("echo-hosts", instance_);
  asker.patience = kHostPatience;
  asker.on_waiting = [](const std::string& /*whom*/) {};
  try {
    const wire::Status status = fetch_status(std::move(asker), kHostAnswerTime);
    for (auto& [name, known] : known_) {
      const wire::SourceStatus* const source = status.find_source(name);
      if (known.is_said || source == nullptr || !source->open) continue;
      const std::string host = watch::host_of(*source);
      if (host == watch::kUnknownHost) continue;
      known.is_said = true;
      known.host = host;
    }
    ask_again_ = shm::monotonic_now() + kAskAgain;
  } catch (const std::exception&) {
    ask_again_ = shm::monotonic_now() + kAskAgainInVain;
  }
}

}  // namespace arbiter::cli
