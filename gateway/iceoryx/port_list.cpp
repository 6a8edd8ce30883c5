#include "gateway/iceoryx/port_list.hpp"

namespace arbiter::gateway {
namespace {

iox::popo::SubscriberOptions newest_only() {
  iox::popo::SubscriberOptions options;
  options.queueCapacity = 1;
  options.historyRequest = 1;  // RouDi sends it when it changes
  return options;
}

template <std::uint64_t Capacity>
std::string text_of(const iox::cxx::string<Capacity>& text) {
  return {text.c_str(), static_cast<std::size_t>(text.size())};
}

}  // namespace

PortList::PortList()
    : news_(iox::roudi::IntrospectionPortService, newest_only()),
      beat_(iox::roudi::IntrospectionPortThroughputService, newest_only()) {}

bool PortList::hears_roudi() { return !beat_.take().has_error(); }

PortList::End PortList::end_of(const iox::roudi::PortData& data) {
  return {text_of(data.m_caproServiceID), text_of(data.m_caproInstanceID),
          text_of(data.m_caproEventMethodID), text_of(data.m_name)};
}

bool PortList::update() {
  bool is_new = false;
  news_.take().and_then([&](const auto& sample) {
    is_new = true;
    publishers_.clear();
    subscribers_.clear();
    for (const auto& each : sample->m_publisherList) publishers_.push_back(end_of(each));
    for (const auto& each : sample->m_subscriberList) subscribers_.push_back(end_of(each));
  });
  return is_new;
}

std::vector<std::string> PortList::those_of(const std::vector<End>& ends,
                                            const IceoryxTopic& topic) {
  std::vector<std::string> result;
  for (const End& each : ends) {
    const bool is_its = each.service == topic.service && each.instance == topic.instance &&
                        each.event == topic.event;
    if (is_its) result.push_back(each.runtime);
  }
  return result;
}

std::vector<std::string> PortList::publishers_of(const IceoryxTopic& topic) const {
  return those_of(publishers_, topic);
}

std::vector<std::string> PortList::subscribers_of(const IceoryxTopic& topic) const {
  return those_of(subscribers_, topic);
}

}  // namespace arbiter::gateway
