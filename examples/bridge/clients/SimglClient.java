// A client of simgl/1 for Java 17 (Debian: default-jdk-headless libjeromq-java libmsgpack-java):
// java -cp /usr/share/java/jeromq.jar:/usr/share/java/msgpack-core.jar SimglClient.java ADDRESS
import java.io.IOException;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.util.List;
import java.util.Map;
import org.msgpack.core.MessagePack;
import org.msgpack.core.MessagePacker;
import org.msgpack.value.Value;
import org.msgpack.value.ValueFactory;
import org.zeromq.ZContext;
import org.zeromq.ZMQ;
import org.zeromq.ZMsg;

public class SimglClient {
    static void pack(MessagePacker to, Object value) throws IOException {
        if (value instanceof Map<?, ?> map) {
            to.packMapHeader(map.size());
            for (var entry : map.entrySet()) { pack(to, entry.getKey()); pack(to, entry.getValue()); }
        } else if (value instanceof List<?> list) {
            to.packArrayHeader(list.size());
            for (Object item : list) pack(to, item);
        } else if (value instanceof Double number) to.packDouble(number);
        else if (value instanceof Long number) to.packLong(number);
        else to.packString((String) value);
    }
    static Value at(Value map, String key) {
        return map.asMapValue().map().get(ValueFactory.newString(key));
    }
    /** The payload of the reply of a kind, behind its header. */
    static ZMsg ask(ZMQ.Socket socket, String kind, Map<String, Object> header) throws IOException {
        var packer = MessagePack.newDefaultBufferPacker();
        pack(packer, header);
        socket.sendMore("simgl/1");
        socket.send(packer.toByteArray());
        for (;;) {
            ZMsg reply = ZMsg.recvMsg(socket);
            if (reply == null) throw new IOException("no answer in time");
            reply.pop();
            String type = at(header(reply), "type").toString();
            if (type.equals("error")) throw new IOException(header(reply).toString());
            if (type.equals("bye")) throw new IOException("the server said goodbye");
            if (type.equals(kind)) return reply; // not the pong of a server that starts
        }
    }
    static Value header(ZMsg reply) throws IOException {
        return MessagePack.newDefaultUnpacker(reply.peekFirst().getData()).unpackValue();
    }
    public static void main(String[] words) throws IOException {
        try (ZContext context = new ZContext()) {
            ZMQ.Socket socket = context.createSocket(ZMQ.DEALER);
            socket.setReceiveTimeOut(10_000);
            socket.connect(words.length > 0 ? words[0] : "tcp://127.0.0.1:5563");
            Value welcome = header(ask(socket, "welcome", Map.of(
                "type", "hello", "client", "java", "versions", List.of("simgl/1"))));
            String camera = at(at(welcome, "cameras").asArrayValue().get(0), "name").toString();
            var chaser = Map.of("position_m", List.of(0.5, -0.25, 40.0),
                "velocity_m_s", List.of(0.0, 0.0, -0.1),
                "q_icrf_from_body_xyzw", List.of(0.0, 0.0, 0.0, 1.0));
            ZMsg images = ask(socket, "images", Map.of("type", "render", "id", 1L,
                "tai_ns", at(welcome, "epoch_tai_ns").asIntegerValue().asLong(),
                "cameras", List.of(Map.of("camera", camera)), "bodies", Map.of("chaser", chaser)));
            Value plane = at(at(at(header(images), "images").asArrayValue().get(0), "planes")
                .asArrayValue().get(0), "shape");
            var dn = ByteBuffer.wrap(images.getLast().getData()).order(ByteOrder.LITTLE_ENDIAN);
            long sum = 0;
            while (dn.hasRemaining()) sum += dn.getShort() & 0xffff;
            System.out.printf("%s x %s, sum %d, %s%n", plane.asArrayValue().get(1),
                plane.asArrayValue().get(0), sum, at(header(images), "state_hash"));
        }
    }
}
