#include "link/import.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "link/say_sparingly.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {
namespace {

using gateway::Level;

constexpr shm::Nanoseconds kOpenAgain = 1'000'000'000;
// Counts go up with each event, and each description is a message to the daemon.
constexpr shm::Nanoseconds kDescribeAgain = 1'000'000'000;

Type type_of(const shm::TypeInfo& info) {
  if (!info.is_typed()) return Type::untyped(static_cast<std::size_t>(info.size));
  return {info.type_name(), static_cast<std::size_t>(info.size),
          static_cast<std::size_t>(info.alignment)};
}

}  // namespace

Import::Import(Node& node, const Network& network, const SentTokens& tokens, std::string source,
               Incarnation me, const gateway::Bell& bell, DemandTeller& demands, SourceUse use,
               const Stream& stream)
    : node_(node),
      tokens_(tokens),
      source_(std::move(source)),
      me_(me),
      demands_(demands),
      offers_(source_),
      stream_(stream),
      demand_(use, shm::monotonic_now()),
      said_demand_(demand_.demand()) {
  unheard_.reserve(kMaxUnheard);
  header_.tokens.reserve(kMaxImporters);
  gateway::dds::SampleTaker& taker = *this;  // a private base
  reader_.emplace(network, source_, taker, bell, DemandCard{me_, said_demand_});
  const std::lock_guard lock(mutex_);
  demanding_ = reader_->handle();
  say_demand();  // what has come meanwhile may have changed it
}

Import::~Import() { static_cast<void>(end()); }

Stream Import::end() {
  close();          // first: to end the reader takes longer, and a component may want the name
  reader_.reset();  // it calls take() until then
  stream_.pause();
  return stream_;
}

void Import::look(bool is_open_here, SourceUse use, const OtherLinks& others) {
  is_open_here = has_just_yielded() || is_open_here;
  listen_to_speaker(others);
  {
    const std::lock_guard lock(mutex_);
    demand_.set_use(is_open_here ? SourceUse::kNone : use, shm::monotonic_now());
    say_demand();
  }
  const Offer* const speaker = offers_.speaker();
  // The model wants it, or there would be no import.
  const ImportChoice choice = choose_import({true, is_open_here, speaker != nullptr});
  const bool is_other_type = speaker != nullptr && speaker->card.type_revision != revision_;
  const bool is_other_host = speaker == nullptr || speaker->card.incarnation != obeyed_;
  const bool is_open_otherwise = (is_other_type || is_other_host) && is_open();
  if (choice != ImportChoice::kImport || is_open_otherwise) close();
  if (choice == ImportChoice::kSpokenHere) {
    last_host_.clear();  // it was that of a component here since
    const std::lock_guard lock(mutex_);
    stream_.pause();
  }
  obey(choice == ImportChoice::kImport ? speaker : nullptr);
}

void Import::open(bool has_daemon, const Patience& patience) {
  const Offer* const speaker = offers_.speaker();
  const bool is_wanted = obeyed_ != 0 && speaker != nullptr && !is_open();
  const bool may_open = has_daemon && shm::monotonic_now() >= open_again_ && patience.is_left();
  if (is_wanted && may_open && speaker->card.type_revision != 0) {
    open_port(speaker->card);
    // Not before, whether it is open or not: strangers may have it opened again and again.
    open_again_ = shm::monotonic_now() + kOpenAgain;
    patience.note_call();
  }
  describe();
}

bool Import::is_open() const {
  const std::lock_guard lock(mutex_);
  return port_ != nullptr;
}

void Import::yield() {
  std::shared_ptr<OutputPort<void>> gone;
  {
    const std::lock_guard lock(mutex_);
    if (!port_ || !port_->asked_to_yield()) return;
    spoken_here_until_ = shm::monotonic_now() + kOpenAgain;
    gone.swap(port_);
  }
  gone.reset();
  say_sparingly(Level::kInfo, source_ +
                                  " is opened by a component of this host, and is not "
                                  "imported any more");
}

bool Import::has_just_yielded() {
  yield();  // a port that has only just been opened
  const std::lock_guard lock(mutex_);
  return shm::monotonic_now() < spoken_here_until_;
}

void Import::obey(const Offer* speaker) {
  const std::lock_guard lock(mutex_);
  const Incarnation exporter = speaker == nullptr ? 0 : speaker->card.incarnation;
  const std::uint64_t writer = speaker == nullptr ? 0 : speaker->key;
  if (exporter == obeyed_ && writer == writer_) return;
  obeyed_ = exporter;
  writer_ = writer;
  if (exporter == 0) return;
  stream_.obey(exporter);
  demand_.begin_exporter(shm::monotonic_now());
  const auto last = std::find_if(unheard_.begin(), unheard_.end(),
                                 [&](const Unheard& each) { return each.writer == writer; });
  if (last == unheard_.end()) return;
  // It is noted for its state; its sample no port had.
  const bool is_new = last->exporter == exporter && stream_.note(exporter, last->last);
  if (is_new && last->last.has_sample) ++counts_.too_soon;
  // The same exporter, which is heard by another writer: the port has stayed open.
  if (is_new && port_ && stream_.take_end()) port_->deactivate();
  unheard_.erase(last);
}

void Import::listen_to_speaker(const OtherLinks& others) {
  const Offer* const before = offers_.speaker();
  const std::vector<Offer> offers = reader_->offers(before == nullptr ? 0 : before->key);
  forget(offers);
  offers_.look(offers, others, shm::monotonic_now());
  say_shared_name();
  say_who_speaks();
}

// Forgets exporters that offer nothing any more, if others need their places.
void Import::forget(const std::vector<Offer>& offers) {
  const std::lock_guard lock(mutex_);
  if (unheard_.size() < kMaxUnheard) return;
  std::erase_if(unheard_, [&](const Unheard& each) {
    return std::none_of(offers.begin(), offers.end(),
                        [&](const Offer& offer) { return offer.key == each.writer; });
  });
}

void Import::say_shared_name() {
  const std::string& name = offers_.shared_name();
  if (name == shared_name_said_) return;
  const bool is_said =
      name.empty() ||
      say_sooner_or_later(
          Level::kWarning,
          source_ + " is open on several machines that are all called " + name +
              ", and is taken from the one that came last: give each its own --host");
  if (is_said) shared_name_said_ = name;
}

void Import::say_who_speaks() {
  const std::vector<std::string> hosts = offers_.hosts();
  const std::string text = hosts.size() < 2 ? "" : rules::comma_list(hosts);
  if (text == hosts_said_) return;
  const bool is_said =
      text.empty() ||
      say_sooner_or_later(Level::kWarning,
                          source_ + " is open on several hosts: " + text + "; it is taken from " +
                              offers_.speaker()->card.host + " until that one is gone");
  if (is_said) hosts_said_ = text;
}

void Import::open_port(const OfferCard& card) {
  if (card.type.size > kMaxSampleBytes) {
    say_once(source_ + " of host " + card.host + " is not imported: its samples have up to " +
             std::to_string(card.type.size) + " bytes, and no more than " +
             std::to_string(kMaxSampleBytes) + " cross the network");
    return;
  }
  try {
    OutputPortOptions options;
    options.yields = true;
    auto port =
        std::make_shared<OutputPort<void>>(node_.output_port(source_, type_of(card.type), options));
    const std::lock_guard lock(mutex_);
    port_ = std::move(port);
    awaits_sample_ = false;
    revision_ = card.type_revision;
    // What came before the port was there.
    if (stream_.take_end()) port_->deactivate();
  } catch (const Error& error) {
    say_once(source_ + " of host " + card.host + " is not imported: " + error.what());
    return;
  }
  described_.clear();
  describe_again_ = 0;
  said_.clear();
  last_host_ = card.host;
  say_sparingly(Level::kInfo, source_ + " comes from host " + card.host);
}

void Import::close() {
  std::shared_ptr<OutputPort<void>> gone;
  {
    const std::lock_guard lock(mutex_);
    obeyed_ = 0;
    writer_ = 0;
    gone.swap(port_);
  }
  if (gone) say_sparingly(Level::kInfo, source_ + " is not imported any more");
}

void Import::begin_again() {
  close();
  open_again_ = shm::monotonic_now() + kOpenAgain;
}

void Import::say_once(const std::string& text) {
  if (text != said_ && say_sooner_or_later(Level::kWarning, text)) said_ = text;
}

std::string Import::text() const {
  const Offer* const speaker = offers_.speaker();
  std::string text = "host " + (speaker == nullptr ? std::string("unknown") : speaker->card.host);
  const std::vector<std::string> hosts = offers_.hosts();
  if (hosts.size() > 1) text += ", open on several hosts: " + rules::comma_list(hosts);
  if (const std::string& name = offers_.shared_name(); !name.empty()) {
    text += ", several machines are called " + name;
  }
  const std::lock_guard lock(mutex_);
  const auto count = [&](std::uint64_t number, const char* what) {
    if (number != 0) text += ", " + std::to_string(number) + what;
  };
  count(stream_.lost(), " lost");
  count(counts_.without_sample, " without their samples");
  count(counts_.late, " late");
  count(counts_.withheld, " withheld");
  count(counts_.unbelieved, " withheld though they were wanted");
  count(stream_.doubled(), " that came twice");
  count(counts_.too_soon, " before the port was open");
  count(counts_.unreadable, " unreadable");
  count(counts_.no_memory, " without memory");
  return text;
}

wire::ImportStatus Import::status() const {
  wire::ImportStatus status;
  status.source = source_;
  const Offer* const speaker = offers_.speaker();
  status.host = speaker == nullptr ? last_host_ : speaker->card.host;
  status.hosts = offers_.hosts();
  const std::lock_guard lock(mutex_);
  status.is_open = port_ != nullptr;
  status.lost = stream_.lost();
  status.without_sample = counts_.without_sample;
  status.late = counts_.late;
  status.withheld = counts_.withheld;
  return status;
}

void Import::describe() {
  const shm::Nanoseconds time = shm::monotonic_now();
  if (!is_open() || time < describe_again_) return;
  std::string now = text();
  if (now == described_) return;
  std::shared_ptr<OutputPort<void>> port;
  {
    const std::lock_guard lock(mutex_);
    port = port_;
  }
  // Without the lock, for which samples wait: the node has one of its own. If the port is to yield
  // meanwhile, it is closed here.
  if (port) port->describe(now);
  described_ = std::move(now);
  describe_again_ = time + kDescribeAgain;
}

}  // namespace arbiter::link
