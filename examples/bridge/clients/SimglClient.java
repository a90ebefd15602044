// A client of simgl/1 for Java 17, with JeroMQ, Jackson and its MessagePack format
// (Debian: default-jdk-headless libjeromq-java libmsgpack-java):
// java -cp '/usr/share/java/*' SimglClient.java ADDRESS
import com.fasterxml.jackson.databind.JsonNode;
import com.fasterxml.jackson.databind.ObjectMapper;
import java.nio.*;
import java.util.*;
import org.msgpack.jackson.dataformat.MessagePackFactory;
import org.zeromq.*;

public class SimglClient {
    static final ObjectMapper MESSAGEPACK = new ObjectMapper(new MessagePackFactory());

    record Reply(JsonNode header, ZMsg planes) {}

    static Reply ask(ZMQ.Socket socket, String kind, Map<String, Object> request) throws Exception {
        socket.sendMore("simgl/1");
        socket.send(MESSAGEPACK.writeValueAsBytes(request));
        for (;;) {
            ZMsg frames = ZMsg.recvMsg(socket);
            if (frames == null) throw new Exception("no answer in time");
            frames.pop();
            JsonNode header = MESSAGEPACK.readTree(frames.pop().getData()), type = header.get("type");
            if (type.asText().equals("error"))
                throw new Exception(header.get("code").asText() + ": " + header.get("detail").asText());
            if (type.asText().equals("bye")) throw new Exception("the server said goodbye");
            if (type.asText().equals(kind)) return new Reply(header, frames); // not the pong of a server that starts
        }
    }
    public static void main(String[] words) throws Exception {
        try (ZContext context = new ZContext(); ZMQ.Socket socket = context.createSocket(ZMQ.DEALER)) {
            socket.setReceiveTimeOut(10_000);
            socket.connect(words.length > 0 ? words[0] : "tcp://127.0.0.1:5563");
            var hello = Map.of("type", "hello", "client", "java", "versions", List.of("simgl/1"));
            JsonNode welcome = ask(socket, "welcome", hello).header();
            var chaser = Map.of("position_m", List.of(0.5, -0.25, 40.0),
                "velocity_m_s", List.of(0.0, 0.0, -0.1), "q_icrf_from_body_xyzw", List.of(0.0, 0.0, 0.0, 1.0));
            Reply images = ask(socket, "images", Map.of("type", "render", "id", 1,
                "tai_ns", welcome.get("epoch_tai_ns").asLong(), "bodies", Map.of("chaser", chaser),
                "cameras", List.of(Map.of("camera", welcome.at("/cameras/0/name").asText()))));
            JsonNode shape = images.header().at("/images/0/planes/0/shape");
            var dn = ByteBuffer.wrap(images.planes().pop().getData()).order(ByteOrder.LITTLE_ENDIAN);
            long sum = 0;
            while (dn.hasRemaining()) sum += dn.getShort() & 0xffff;
            String hash = images.header().get("state_hash").asText();
            System.out.printf("%s x %s, sum %d, %s%n", shape.get(1), shape.get(0), sum, hash);
        }
    }
}
