#include "link/dds/event_topic.hpp"

#include <dds/ddsi/ddsi_sertype.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>

#include "gateway/dds/opaque_type.hpp"
#include "link/core/topic_names.hpp"
#include "link/dds/demands.hpp"

namespace arbiter::link {
namespace {

using gateway::dds::CycloneQos;

constexpr const char* kEventType = "arbiter::Event";
// A writer that keeps the last event alone need not wait for readers that do not keep up, and in
// Cyclone it does not: no reader holds up the one thread that sends.
constexpr dds_duration_t kMaxBlocking = 0;
// Bounds of what a reader looks at each time and keeps, on a network where anybody may write. Of a
// participant it keeps one: nobody hides others by making many.
constexpr std::size_t kMostLooks = 64;
constexpr std::size_t kMostOffers = 256;
// Usually enough, so that one question is.
constexpr std::size_t kUsualWriters = 64;

CycloneQos event_qos() {
  CycloneQos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, kMaxBlocking);
  dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  return qos;
}

Entity make_topic(const Network& network, const std::string& source, const ddsi_sertype** type) {
  const std::string name = topic_of_source(source);
  ddsi_sertype* made = gateway::dds::make_opaque_type(kEventType, false);
  const dds_entity_t topic = dds_create_topic_sertype(network.participant(), name.c_str(), &made,
                                                      nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(made);
  Entity result(topic, "topic " + name);
  *type = made;
  return result;
}

struct FreeEndpoint {
  void operator()(dds_builtintopic_endpoint_t* endpoint) const {
    dds_builtintopic_free_endpoint(endpoint);
  }
};

std::optional<Offer> offer_of(dds_entity_t reader, dds_instance_handle_t writer) {
  const std::unique_ptr<dds_builtintopic_endpoint_t, FreeEndpoint> endpoint(
      dds_get_matched_publication_data(reader, writer));
  if (endpoint == nullptr || endpoint->qos == nullptr) return std::nullopt;
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(endpoint->qos, &data, &size) || data == nullptr) return std::nullopt;
  auto card = read_offer_card(Bytes(static_cast<const std::byte*>(data), size));
  dds_free(data);
  if (!card) return std::nullopt;
  Offer offer{writer, std::move(*card), {}};
  std::copy_n(std::begin(endpoint->participant_key.v), offer.participant.size(),
              offer.participant.begin());
  return offer;
}

}  // namespace

Bytes encapsulation() noexcept {
  static constexpr std::array<std::byte, 4> kHeader{std::byte{0}, std::byte{1}};
  return {kHeader.data(), kHeader.size()};
}

EventWriter::EventWriter(const Network& network, const OfferCard& card, const gateway::Bell& bell)
    : name_(topic_of_source(card.source)), topic_(make_topic(network, card.source, &type_)) {
  // Cyclone has one pointer for what a listener is given, and does not write through it.
  const gateway::dds::Listener listener(dds_create_listener(const_cast<gateway::Bell*>(&bell)));
  dds_lset_publication_matched(
      listener.get(), [](dds_entity_t /*writer*/, const dds_publication_matched_status_t /*status*/,
                         void* rings) { static_cast<const gateway::Bell*>(rings)->ring(); });
  const CycloneQos qos = event_qos();
  const ByteString data = write_offer_card(card);
  dds_qset_userdata(qos.get(), data.data(), data.size());
  writer_ =
      Entity(dds_create_writer(network.participant(), topic_.get(), qos.get(), listener.get()),
             "a writer of " + topic_of_source(card.source));
}

bool EventWriter::is_wanted() const {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(writer_.get(), &status) == DDS_RETCODE_OK &&
         status.current_count > 0;
}

Demand EventWriter::demand() const { return demand_of_readers(writer_.get()); }

std::uint32_t EventWriter::changes_of_readers() const {
  dds_publication_matched_status_t status{};
  static_cast<void>(dds_get_publication_matched_status(writer_.get(), &status));
  return 2 * status.total_count - status.current_count;  // those that came, and those that went
}

void EventWriter::set_card(const OfferCard& card) {
  const CycloneQos qos(dds_create_qos());
  const ByteString data = write_offer_card(card);
  dds_qset_userdata(qos.get(), data.data(), data.size());
  const dds_return_t set = dds_set_qos(writer_.get(), qos.get());
  if (set < 0) {
    throw DdsError("the type of " + card.source + " cannot be made known: " + dds_strretcode(-set));
  }
}

bool EventWriter::write(Bytes header, Bytes sample) noexcept {
  gateway::dds::Payload* const payload =
      gateway::dds::make_payload(type_, {encapsulation(), header, sample});
  return payload != nullptr && dds_writecdr(writer_.get(), &payload->cyclone) == DDS_RETCODE_OK;
}

EventReader::EventReader(const Network& network, const std::string& source,
                         gateway::dds::SampleTaker& taker, const gateway::Bell& bell,
                         const DemandCard& demand)
    : cache_(taker) {
  const gateway::dds::Listener listener(dds_create_listener(const_cast<gateway::Bell*>(&bell)));
  dds_lset_subscription_matched(
      listener.get(),
      [](dds_entity_t /*reader*/, const dds_subscription_matched_status_t /*status*/, void* rings) {
        static_cast<const gateway::Bell*>(rings)->ring();
      });
  const ddsi_sertype* type = nullptr;
  topic_ = make_topic(network, source, &type);
  const CycloneQos qos = event_qos();
  const ByteString data = write_demand_card(demand);
  dds_qset_userdata(qos.get(), data.data(), data.size());
  reader_ = Entity(dds_create_reader_rhc(network.participant(), topic_.get(), qos.get(),
                                         listener.get(), cache_.cache()),
                   "a reader of " + topic_of_source(source));
}

std::vector<Offer> EventReader::offers(std::uint64_t current) {
  std::vector<std::uint64_t> writers = writers_of(reader_.get());
  std::sort(writers.begin(), writers.end());
  std::erase_if(offers_, [&](const auto& each) {
    return !std::binary_search(writers.begin(), writers.end(), each.first);
  });
  if (std::binary_search(writers.begin(), writers.end(), current)) look_at(current);
  // Those after the last one, and then from the beginning.
  std::rotate(writers.begin(), std::upper_bound(writers.begin(), writers.end(), looked_at_),
              writers.end());
  for (std::size_t i = 0; i < std::min(writers.size(), kMostLooks); ++i) {
    looked_at_ = writers[i];
    if (looked_at_ != current) look_at(looked_at_);
  }
  std::vector<Offer> offers;
  for (const auto& [key, offer] : offers_) {
    offers.insert(key == current ? offers.begin() : offers.end(), offer);
  }
  return offers;
}

void EventReader::look_at(std::uint64_t writer) {
  offers_.erase(writer);
  auto offer = offer_of(reader_.get(), writer);
  if (!offer) return;
  const auto other = std::find_if(offers_.begin(), offers_.end(), [&](const auto& each) {
    return each.second.participant == offer->participant;
  });
  if (other != offers_.end()) {
    if (!is_newer(offer->card.incarnation, other->second.card.incarnation)) return;
    offers_.erase(other);
  }
  if (offers_.size() < kMostOffers) offers_.emplace(writer, std::move(*offer));
}

std::vector<std::uint64_t> writers_of(dds_entity_t reader) {
  std::vector<dds_instance_handle_t> writers(kUsualWriters);
  for (;;) {
    const dds_return_t found = dds_get_matched_publications(reader, writers.data(), writers.size());
    const std::size_t count = found < 0 ? 0 : static_cast<std::size_t>(found);
    const bool are_all = count <= writers.size();
    writers.resize(are_all ? count : 2 * count);  // others may be coming
    if (are_all) return writers;
  }
}

}  // namespace arbiter::link
