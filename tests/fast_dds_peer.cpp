// A peer of scenecast in ROS 2: Fast DDS on the loopback network, without multicast. It moves messages in CDR between its
// standard streams and topics, so that no code has to be generated for their types.
//
// usage: fast_dds_peer DOMAIN
//
// Commands on the standard input, each a line:
//   write TOPIC TYPE QOS LENGTH   publishes the LENGTH bytes after the line, once the topic has a subscriber
//   read TOPIC TYPE QOS SECONDS   waits for a message; writes "LENGTH" or, if none comes, "0" as a line, then the bytes
//   wait SECONDS                  waits
// QOS is sensor, state or latched.

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

using namespace eprosima::fastdds::dds;
using namespace eprosima::fastrtps::rtps;
using Bytes = std::vector<unsigned char>;
using Clock = std::chrono::steady_clock;

namespace {

/// The longest message: an image of 1360 x 1024 and its header have 4.2 MB.
constexpr uint32_t MAX_BYTES = 16'000'000;

/// Messages of any type as their bytes in CDR, the encapsulation included.
class Cdr : public TopicDataType {
public:
    explicit Cdr(const std::string& name) {
        setName(name.c_str());
        m_typeSize = MAX_BYTES;
        m_isGetKeyDefined = false;
    }

    bool serialize(void* data, SerializedPayload_t* payload) override {
        const auto& bytes = *static_cast<Bytes*>(data);
        std::memcpy(payload->data, bytes.data(), bytes.size());
        payload->length = static_cast<uint32_t>(bytes.size());
        payload->encapsulation = CDR_LE;
        return true;
    }

    bool deserialize(SerializedPayload_t* payload, void* data) override {
        static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }

    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
    }

    void* createData() override { return new Bytes; }
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

[[noreturn]] void fail(const std::string& text) {
    std::cerr << "fast_dds_peer: " << text << std::endl;
    std::exit(1);
}

DomainParticipant* participant(uint32_t domain) {
    DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.emplace_back("127.0.0.1");
    udp->sendBufferSize = 4 << 20;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    // The ports of discovery of the first participants of the domain (RTPS 9.6.1).
    for (uint32_t number = 0; number < 10; ++number) {
        Locator_t at;
        IPLocator::setIPv4(at, 127, 0, 0, 1);
        at.port = 7400 + 250 * domain + 10 + 2 * number;
        qos.wire_protocol().builtin.initialPeersList.push_back(at);
    }
    auto* found = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    return found ? found : (fail("no participant"), nullptr);
}

template <typename Qos>
void set(Qos& qos, const std::string& kind) {
    qos.reliability().kind = kind == "sensor" ? BEST_EFFORT_RELIABILITY_QOS : RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = kind == "latched" ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = kind == "latched" ? 1 : 10;
    qos.endpoint().history_memory_policy = DYNAMIC_RESERVE_MEMORY_MODE;
}

class Peer {
public:
    explicit Peer(uint32_t domain)
        : participant_(participant(domain)),
          publisher_(participant_->create_publisher(PUBLISHER_QOS_DEFAULT)),
          subscriber_(participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT)) {}

    void write(const std::string& name, const std::string& type, const std::string& kind, Bytes bytes) {
        auto*& writer = writers_[name];
        if (!writer) {
            DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
            set(qos, kind);
            // Messages that are longer than a datagram need it.
            qos.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;
            writer = publisher_->create_datawriter(topic(name, type), qos);
        }
        const auto until = Clock::now() + std::chrono::seconds(60);
        PublicationMatchedStatus status{};
        while (writer->get_publication_matched_status(status), status.current_count == 0) {
            if (Clock::now() > until) fail(name + " has no subscriber");
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        if (!writer->write(&bytes)) fail(name + ": a message was refused");
    }

    Bytes read(const std::string& name, const std::string& type, const std::string& kind, double seconds) {
        auto*& reader = readers_[name];
        if (!reader) {
            DataReaderQos qos = DATAREADER_QOS_DEFAULT;
            set(qos, kind);
            reader = subscriber_->create_datareader(topic(name, type), qos);
        }
        Bytes bytes;
        SampleInfo info;
        const auto until = Clock::now() + std::chrono::duration<double>(seconds);
        while (Clock::now() < until) {
            if (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK && info.valid_data) return bytes;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return {};
    }

private:
    Topic* topic(const std::string& name, const std::string& type) {
        TypeSupport(new Cdr(type)).register_type(participant_);
        auto* topic = participant_->create_topic("rt" + name, type, TOPIC_QOS_DEFAULT);
        return topic ? topic : (fail("no topic " + name), nullptr);
    }

    DomainParticipant* participant_;
    Publisher* publisher_;
    Subscriber* subscriber_;
    std::map<std::string, DataWriter*> writers_;
    std::map<std::string, DataReader*> readers_;
};

}  // namespace

int main(int count, char** arguments) {
    if (count != 2) fail("usage: fast_dds_peer DOMAIN");
    Peer peer(static_cast<uint32_t>(std::stoul(arguments[1])));
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream words(line);
        std::string command, topic, type, qos;
        words >> command;
        if (command == "write") {
            uint32_t length = 0;
            if (!(words >> topic >> type >> qos >> length) || length > MAX_BYTES) fail("wrong line: " + line);
            Bytes bytes(length);
            std::cin.read(reinterpret_cast<char*>(bytes.data()), length);
            peer.write(topic, type, qos, std::move(bytes));
        } else if (command == "read") {
            double seconds = 0;
            if (!(words >> topic >> type >> qos >> seconds)) fail("wrong line: " + line);
            const Bytes bytes = peer.read(topic, type, qos, seconds);
            std::cout << bytes.size() << '\n';
            std::cout.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
            std::cout.flush();
        } else if (command == "wait") {
            double seconds = 0;
            words >> seconds;
            std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
        } else {
            fail("wrong line: " + line);
        }
    }
    return 0;
}
