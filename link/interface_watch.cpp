#include "link/interface_watch.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>
#include <utility>

namespace arbiter::link {
namespace {

// More than the kernel puts into one datagram.
constexpr std::size_t kMostNetlinkBytes = 32'768;
// Datagrams of netlink that are read at once: whoever changes interfaces all the time must not keep
// the loop here. What is left is read the next time.
constexpr int kMostHeardAtOnce = 64;

shm::FileDescriptor open_netlink() {
  shm::FileDescriptor netlink(
      ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE));
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = RTMGRP_LINK | RTMGRP_IPV4_IFADDR;
  if (!netlink ||
      ::bind(netlink.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    throw std::system_error(errno, std::generic_category(), "watching network interfaces");
  }
  return netlink;
}

std::uint32_t address_of(const sockaddr* address) {
  sockaddr_in internet{};
  std::memcpy(&internet, address, sizeof internet);
  return internet.sin_addr.s_addr;
}

std::string address_text(std::uint32_t address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  in_addr internet{};
  internet.s_addr = address;
  return ::inet_ntop(AF_INET, &internet, text.data(), text.size()) == nullptr ? "" : text.data();
}

// Of a message that an address has gone: which.
std::uint32_t local_address(const ifaddrmsg* message, std::size_t size) {
  auto left = static_cast<int>(size);
  for (const rtattr* each = IFA_RTA(message); RTA_OK(each, left); each = RTA_NEXT(each, left)) {
    if (each->rta_type != IFA_LOCAL || RTA_PAYLOAD(each) < sizeof(std::uint32_t)) continue;
    std::uint32_t address = 0;
    std::memcpy(&address, RTA_DATA(each), sizeof address);
    return address;
  }
  return 0;
}

}  // namespace

InterfaceWatch::InterfaceWatch(std::vector<std::string> interfaces)
    : interfaces_(std::move(interfaces)), netlink_(open_netlink()) {}

std::vector<std::string> InterfaceWatch::there() const {
  std::vector<std::string> all;
  for (const std::string& each : interfaces_) {
    const auto place = places_.find(each);
    if (place != places_.end() && place->second.is_usable()) all.push_back(each);
  }
  return all;
}

std::string InterfaceWatch::missing() const {
  const auto lost = std::find_if(places_.begin(), places_.end(),
                                 [](const auto& each) { return each.second.index == 0; });
  if (lost == places_.end()) return {};
  std::string there;
  const std::unique_ptr<struct if_nameindex, void (*)(struct if_nameindex*)> all(
      ::if_nameindex(), [](struct if_nameindex* each) { ::if_freenameindex(each); });
  for (const auto* each = all.get(); each != nullptr && each->if_index != 0; ++each) {
    there += (there.empty() ? "" : ", ") + std::string(each->if_name);
  }
  return "this machine has no interface " + lost->first + " (--interface), but " +
         (there.empty() ? "none at all" : there);
}

void InterfaceWatch::begin() {
  // What is left over is heard as a change: the link joins once more than it would have to.
  static_cast<void>(hear(was_gone_));
  was_gone_ = false;
  const auto now = look();
  has_news_ = !now;
  places_ = now.value_or(Places());
}

std::string InterfaceWatch::change() {
  has_news_ = hear(was_gone_) || has_news_;
  if (!has_news_) return {};
  const auto now = look();
  if (!now) return {};  // the next time
  has_news_ = false;
  const bool was_gone = std::exchange(was_gone_, false);
  for (const auto& [name, place] : *now) {
    const Place& before = places_[name];
    // One that goes down and comes up is joined all the while, unless it was down at the beginning.
    const bool was_out = !before.is_usable();
    if (was_out ? !place.is_usable() : place == before) continue;
    if (place.index == 0) return "the network interface " + name + " has gone";
    if (place.address == 0) return "the network interface " + name + " has no address any more";
    const bool is_other = before.address != 0 && place.index != before.index;
    if (is_other) return "the network interface " + name + " is another one";
    return "the network interface " + name + " has the address " + address_text(place.address) +
           " now";
  }
  return was_gone ? "a network interface was gone" : "";
}

std::optional<InterfaceWatch::Places> InterfaceWatch::look() const {
  Places places;
  for (const std::string& each : interfaces_) places[each].index = ::if_nametoindex(each.c_str());
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return std::nullopt;
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owned(list, ::freeifaddrs);
  for (const ifaddrs* each = list; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET) continue;
    const std::uint32_t address = address_of(each->ifa_addr);
    for (const std::string& name : {std::string(each->ifa_name), address_text(address)}) {
      const auto ours = places.find(name);
      if (ours == places.end() || ours->second.address != 0) continue;
      ours->second = {::if_nametoindex(each->ifa_name), address, (each->ifa_flags & IFF_UP) != 0};
    }
  }
  return places;
}

bool InterfaceWatch::hear(bool& was_gone) {
  alignas(nlmsghdr) std::array<char, kMostNetlinkBytes> bytes;
  bool has_news = false;
  for (int i = 0; i < kMostHeardAtOnce; ++i) {
    sockaddr_nl sender{};
    socklen_t size_of_sender = sizeof sender;
    const ssize_t size = ::recvfrom(netlink_.get(), bytes.data(), bytes.size(), 0,
                                    reinterpret_cast<sockaddr*>(&sender), &size_of_sender);
    if (size < 0 && errno != ENOBUFS) break;
    has_news = true;
    if (size < 0) {  // some of them are lost: which, nobody knows
      was_gone = true;
      continue;
    }
    if (sender.nl_pid != 0) continue;  // not the kernel's
    auto left = static_cast<unsigned>(size);
    for (auto* each = reinterpret_cast<const nlmsghdr*>(bytes.data()); NLMSG_OK(each, left);
         each = NLMSG_NEXT(each, left)) {
      was_gone = is_loss_of_ours(each) || was_gone;
    }
  }
  return has_news;
}

bool InterfaceWatch::is_loss_of_ours(const void* message) const {
  const auto* const header = static_cast<const nlmsghdr*>(message);
  if (header->nlmsg_type == RTM_DELLINK && header->nlmsg_len >= NLMSG_LENGTH(sizeof(ifinfomsg))) {
    const auto* const gone = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
    return std::any_of(places_.begin(), places_.end(), [&](const auto& each) {
      return each.second.address != 0 && static_cast<int>(each.second.index) == gone->ifi_index;
    });
  }
  if (header->nlmsg_type != RTM_DELADDR || header->nlmsg_len < NLMSG_LENGTH(sizeof(ifaddrmsg))) {
    return false;
  }
  const auto* const gone = static_cast<const ifaddrmsg*>(NLMSG_DATA(header));
  const std::uint32_t address = local_address(gone, IFA_PAYLOAD(header));
  return std::any_of(places_.begin(), places_.end(), [&](const auto& each) {
    return each.second.index == gone->ifa_index && each.second.address == address;
  });
}

}  // namespace arbiter::link
