#include "gateway/iceoryx/publishers.hpp"

namespace arbiter::gateway {
namespace {

iox::popo::SubscriberOptions newest_only() {
  iox::popo::SubscriberOptions options;
  options.queueCapacity = 1;
  options.historyRequest = 1;  // RouDi sends it when it changes
  return options;
}

std::string text_of(const iox::capro::IdString_t& id) { return {id.c_str(), id.size()}; }

}  // namespace

Publishers::Publishers() : subscriber_(iox::roudi::IntrospectionPortService, newest_only()) {}

bool Publishers::update() {
  bool is_new = false;
  subscriber_.take().and_then([&](const auto& sample) {
    is_new = true;
    all_.clear();
    for (const iox::roudi::PublisherPortData& each : sample->m_publisherList) {
      all_.push_back({text_of(each.m_caproServiceID), text_of(each.m_caproInstanceID),
                      text_of(each.m_caproEventMethodID),
                      std::string(each.m_name.c_str(), each.m_name.size())});
    }
  });
  return is_new;
}

std::vector<std::string> Publishers::of(const IceoryxTopic& topic) const {
  std::vector<std::string> result;
  for (const Publisher& each : all_) {
    const bool is_its = each.service == topic.service && each.instance == topic.instance &&
                        each.event == topic.event;
    if (is_its) result.push_back(each.runtime);
  }
  return result;
}

}  // namespace arbiter::gateway
