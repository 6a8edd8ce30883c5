#include "link/link.hpp"

#include <poll.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "gateway/core/say.hpp"
#include "gateway/dds/domain.hpp"
#include "link/core/what_passes.hpp"
#include "link/first_failure.hpp"
#include "link/say_sparingly.hpp"
#include "shm/clock.hpp"
#include "shm/limits.hpp"
#include "watch/imported.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::link {
namespace {

using gateway::Level;
using gateway::say;

constexpr int kLookPeriod = 100;    // ms
constexpr int kRetryPeriod = 1000;  // ms
// While the network is joined or left: for two minutes at most.
constexpr shm::Nanoseconds kRoundOfWaiting = 500'000'000;
constexpr int kMostRoundsOfWaiting = 240;
// More often than the daemon is asked what is open.
constexpr shm::Nanoseconds kTellPeriod = 200'000'000;

Incarnation new_incarnation() {
  Incarnation incarnation = 0;
  while (incarnation == 0) {
    if (::getrandom(&incarnation, sizeof incarnation, 0) != sizeof incarnation && errno != EINTR) {
      throw std::system_error(errno, std::generic_category(), "no random number");
    }
    incarnation >>= 1;  // exports count up from it, and must not come round (offers.hpp)
  }
  return incarnation;
}

std::string name_of(const NetworkOptions& network) {
  if (network.interfaces.empty()) return "the loopback interface";
  std::string text;
  for (const std::string& each : network.interfaces) text += (text.empty() ? "" : ", ") + each;
  return text;
}

HostCard own_card(const LinkOptions& options, Incarnation incarnation) {
  HostCard card;
  card.host = options.host;
  card.instance = wire::instance_name(options.instance);
  card.version = options.version;
  card.incarnation = incarnation;
  return card;
}

}  // namespace

Link::Link(LinkOptions options, gateway::dds::PeerWatch& peers, Neighbours known)
    : options_(std::move(options)),
      incarnation_(new_incarnation()),
      view_(options_.instance, options_.max_age),
      interfaces_(options_.network.interfaces.empty() ? std::vector<std::string>{"lo"}
                                                      : options_.network.interfaces),
      peers_(peers),
      desk_(std::make_unique<Desk>(own_card(options_, incarnation_), std::move(known))) {
  gateway::dds::hear_cyclone();
}

Link::~Link() {
  Imports gone;
  {
    const std::lock_guard lock(imports_mutex_);
    gone.swap(imports_);
  }
  end(std::move(gone));
  // Hundreds of exports may each wait for hosts that are cut off.
  while_seen([this] { leave_network(); });
}

template <class Step>
void Link::while_seen(const Step& step) const {
  std::optional<TokenClock> rounds;
  try {
    rounds.emplace([this, left = kMostRoundsOfWaiting]() mutable {
      if (left-- > 0) options_.on_round();
    });
    rounds->set_period(kRoundOfWaiting);
  } catch (const std::system_error&) {  // there is no thread left: then nobody sees it
  }
  step();
}

// Each waits for Cyclone where it ends, and a component that wants its name must not.
void Link::end(Imports gone) {
  for (const auto& [source, one] : gone) one->close();
  for (auto each = gone.begin(); each != gone.end(); each = gone.erase(each)) {
    remember(each->first, each->second->end());
    options_.on_round();
  }
}

// The exporter may still keep the last event for other hosts, and would send it once more.
void Link::remember(const std::string& source, const Stream& stream) {
  if (streams_.size() >= shm::kMaxSources && !streams_.contains(source)) {
    streams_.erase(streams_.begin());  // of models that are long gone
  }
  streams_[source] = stream;
}

std::unique_ptr<Desk> Link::take_desk() {
  desk_->close();
  return std::move(desk_);
}

void Link::hear(const Notice& notice) {
  if (notice.kind != NoticeKind::asked_to_yield) {
    say(Level::kWarning, notice.text);
    return;
  }
  const std::lock_guard lock(imports_mutex_);
  const auto found = imports_.find(notice.port);
  if (found != imports_.end()) found->second->yield();
  bell_.ring();
}

Link::End Link::run(int stop) {
  make_node(stop);
  if (!stops_) join_network(stop);
  return stops_ ? End::kStopped : loop(stop);
}

bool Link::has_network_changed() {
  std::string change = interfaces_.change();
  if (!change.empty()) {
    network_->note_cut_off();
  } else {
    change = change_of_peers();
  }
  if (change.empty()) return false;
  say_sparingly(Level::kWarning, change + ": joining the network again");
  return true;
}

// To join again is silence for a while. Where as many hosts are there as are looked for, they have
// found this one, or each other; but one of them may be another, or about to be lost.
std::string Link::change_of_peers() const {
  std::string change = peers_.change();
  const bool are_all_there = desk_->others().cards.size() >= options_.network.peers.size();
  return are_all_there || change.empty() ? std::string() : "--peer " + change;
}

void Link::say_what_passes() {
  if (has_said_what_passes_ || !view_.has_daemon() || !view_.obstacle().empty()) return;
  has_said_what_passes_ = true;
  std::vector<std::string> offered;
  for (const auto& [source, type] : view_.open_here()) offered.push_back(source);
  std::vector<std::string> wanted;
  for (const auto& [source, age] : view_.wanted()) wanted.push_back(source);
  say(Level::kInfo, what_passes(offered, wanted));
}

bool Link::waits(int stop, int milliseconds) const {
  std::array<pollfd, 2> ends{{{stop, POLLIN, 0}, {bell_.descriptor(), POLLIN, 0}}};
  static_cast<void>(::poll(ends.data(), ends.size(), milliseconds));
  bell_.silence();
  return (ends[0].revents & POLLIN) != 0;
}

void Link::say_once(std::string& said, const std::string& text) {
  if (text == said) return;
  said = text;
  if (!text.empty()) say(Level::kWarning, text);
}

void Link::make_node(int stop) {
  NodeOptions options;
  options.instance = options_.instance;
  options.connect_timeout = std::chrono::milliseconds(200);
  options.on_waiting = [](const std::string&) {};
  options.on_notice = [this](const Notice& notice) { hear(notice); };
  while (!node_ && !stops_) {
    options_.on_round();
    try {
      node_.emplace(watch::kLinkNode, options);
    } catch (const Error& error) {
      say_once(said_, error.what());
      tell_desk(said_);
      stops_ = waits(stop, kRetryPeriod / 2);
    }
  }
}

// An interface may come later, and DDS Security may forbid a topic until its rules are changed.
void Link::join_network(int stop) {
  while (!network_ && !stops_) {
    options_.on_round();
    const gateway::dds::CycloneWords words;
    interfaces_.begin();
    try {
      enter_network();
      peers_.note_unknown(words.unknown_peers());
      words.tell();  // of peers that have no address, for example
    } catch (const DdsError& error) {
      leave_network();
      std::string why = interfaces_.there().empty() ? interfaces_.missing() : std::string();
      if (why.empty()) why = words.last().empty() ? error.what() : "DDS: " + words.last();
      say_once(said_, why + "; trying again");
      view_.update([] {});  // for whoever asks what is wrong
      options_.on_round();
      tell_desk(said_);
      stops_ = waits(stop, kRetryPeriod);
    }
  }
  if (stops_) return;
  const NetworkOptions there = network_there();
  const std::string text = "host " + options_.host + ", on " + name_of(there);
  if (there.interfaces.empty()) {
    say(Level::kInfo, text + ": nothing leaves this machine (--interface names a network)");
  } else if (there.interfaces.size() == options_.network.interfaces.size()) {
    say(Level::kInfo, text);
  } else {
    say(Level::kWarning,
        text + " alone: of " + name_of(options_.network) +
            " (--interface), the rest is not there now, is down, or has no address");
  }
}

NetworkOptions Link::network_there() const {
  NetworkOptions network = options_.network;
  std::vector<std::string> there = interfaces_.there();
  if (!network.interfaces.empty() && !there.empty()) network.interfaces = std::move(there);
  return network;
}

void Link::enter_network() {
  NetworkOptions there = network_there();
  there.peers = peers_.accept(there.peers);
  // The names of other peers are looked up, and a name server may not answer.
  while_seen([&] { network_.emplace(there); });
  tokens_.emplace(*network_, [this](const TokenMessage& message, std::uint64_t writer) {
    held_.note(message.importer, message.number, writer, shm::monotonic_now());
  });
  demands_.emplace();
  exports_.emplace(*node_, *network_, held_, options_.host, incarnation_, bell_);
  clock_.emplace([this] { tokens_->send({incarnation_, sent_.next(time_with_sleep())}); });
  desk_->join(*network_, name_of(there), bell_);
}

void Link::leave_network() {
  if (desk_ != nullptr) desk_->leave();
  clock_.reset();
  exports_.reset();
  demands_.reset();
  tokens_.reset();
  network_.reset();
}

Link::End Link::loop(int stop) {
  std::string said_of_exports;
  std::string said_of_imports;
  // What fails on one side does not hold up the other.
  const auto attempt = [this](std::string& said, const auto& step) {
    try {
      step();
      said.clear();
    } catch (const DdsError& error) {  // memory is short
      say_once(said, error.what());
    }
  };
  for (; !stops_; stops_ = waits(stop, kLookPeriod)) {
    if (has_network_changed()) return End::kNetworkChanged;
    options_.on_round();
    view_.update([this] { set_max_ages(); });
    say_once(said_of_view_, view_.obstacle());
    say_what_passes();
    leave_lost_ports();
    options_.on_round();
    const Patience patience([] { return shm::monotonic_now(); }, options_.on_round);
    attempt(said_of_exports, [&] { exports_->look(view_, patience); });
    attempt(said_of_imports, [&] { choose_imports(patience); });
    if (shm::monotonic_now() < tell_again_) continue;
    tell_again_ = shm::monotonic_now() + kTellPeriod;
    tell_desk(view_.obstacle());
  }
  if (!interfaces_.change().empty()) network_->note_cut_off();
  return End::kStopped;
}

// The components that have them from this link cannot come back either, until they are restarted.
// What is tapped ends by itself: the daemon names none of its sources as open.
void Link::leave_lost_ports() {
  if (view_.turned_away() <= left_) return;
  left_ = shm::monotonic_now();
  say_sparingly(Level::kWarning,
                "the daemon does not know what this link has open, because the state of the last "
                "daemon is lost: opening it again");
  for (const auto& [source, one] : imports_) one->begin_again();
}

// What the model before would have let in is late from now on.
void Link::set_max_ages() {
  for (const auto& [source, one] : imports_) {
    const auto age = view_.wanted().find(source);
    if (age != view_.wanted().end()) one->set_max_age(age->second);
  }
}

// What is to be closed is closed before anything waits for the daemon.
void Link::choose_imports(const Patience& patience) {
  const auto& wanted = view_.wanted();
  Imports gone;
  {
    const std::lock_guard lock(imports_mutex_);
    for (auto each = imports_.begin(); each != imports_.end();) {
      const auto one = each++;
      if (!wanted.contains(one->first)) gone.insert(imports_.extract(one));
    }
  }
  end(std::move(gone));
  set_max_ages();
  const OtherLinks others = desk_->others();
  for (const auto& [source, one] : imports_) {
    one->look(view_.open_here().contains(source), view_.use_of(source), others);
  }
  shm::Nanoseconds shortest = 0;  // no import
  for (const auto& [source, age] : wanted) {
    shortest = shortest == 0 ? age : std::min(shortest, age);
  }
  clock_->set_period(shortest == 0 ? 0 : token_period(shortest));
  for (const auto& [source, one] : imports_) one->open(view_.has_daemon(), patience);
  FirstFailure failure;
  for (const auto& each : wanted) {
    if (imports_.contains(each.first)) continue;
    failure.attempt([&] { add_import(each.first); });
  }
  failure.rethrow();
}

void Link::add_import(const std::string& source) {
  const auto before = streams_.find(source);
  auto one = std::make_unique<Import>(*node_, *network_, sent_, source, incarnation_, bell_,
                                      *demands_, view_.use_of(source),
                                      before == streams_.end() ? Stream() : before->second);
  const std::lock_guard lock(imports_mutex_);
  imports_.emplace(source, std::move(one));
}

void Link::tell_desk(const std::string& obstacle) {
  OwnHost own;
  own.waits_for = obstacle;
  HostCard& card = own.card;
  card.has_daemon = view_.has_daemon();
  card.generation = view_.model().generation;
  card.digest = view_.model().digest;
  card.model = view_.model().name;
  card.inputs.assign(view_.inputs_here().begin(), view_.inputs_here().end());
  for (const auto& [source, type] : view_.open_here()) card.outputs.push_back(source);
  card.input_count = static_cast<std::uint32_t>(card.inputs.size());
  card.output_count = static_cast<std::uint32_t>(card.outputs.size());
  for (const auto& [source, one] : imports_) {
    wire::ImportStatus status = one->status();
    status.is_open_here = view_.open_here().contains(source);
    if (status.is_open) ++card.imports;
    if (!status.hosts.empty() || !status.host.empty()) own.imports.push_back(std::move(status));
  }
  desk_->look(std::move(own));
}

}  // namespace arbiter::link
