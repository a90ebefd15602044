% A client of simgl/1 for MATLAB, and for Octave with Java. Needs JeroMQ, and Jackson with its MessagePack format:
% javaaddpath({'jeromq.jar', 'jackson-core.jar', ...}); dn = simgl_client('tcp://127.0.0.1:5563')
function dn = simgl_client(address)
  socket = javaMethod('socket', javaMethod('context', 'org.zeromq.ZMQ', 1), 5); % a DEALER
  socket.setReceiveTimeOut(10000);
  socket.setLinger(0);
  socket.connect(address);
  welcome = ask(socket, 'welcome', '{"type": "hello", "client": "matlab", "versions": ["simgl/1"]}');
  % The epoch stays text: nanoseconds since 1970 do not fit into a double.
  bodies.chaser = struct('position_m', [0.5, -0.25, 40], 'velocity_m_s', [0, 0, -0.1], ...
    'q_icrf_from_body_xyzw', [0, 0, 0, 1]);
  request = sprintf(['{"type": "render", "id": 1, "tai_ns": %s, "cameras": [{"camera": "%s"}], ' ...
    '"bodies": %s}'], text(welcome, '/epoch_tai_ns'), text(welcome, '/cameras/0/name'), jsonencode(bodies));
  [images, frames] = ask(socket, 'images', request);
  height = str2double(text(images, '/images/0/planes/0/shape/0'));
  width = str2double(text(images, '/images/0/planes/0/shape/1'));
  plane = frames.getLast();
  pixels = typecast(plane.getData(), 'uint16'); % little-endian, as numbers of this machine
  dn = reshape(pixels, width, height)'; % row by row
  fprintf('%d x %d, sum %d, %s\n', width, height, sum(double(dn(:))), text(images, '/state_hash'));
  socket.close();
end

function [header, frames] = ask(socket, kind, request) % the reply of a kind to a request in JSON
  json = javaObject('com.fasterxml.jackson.databind.ObjectMapper');
  messagepack = javaObject('com.fasterxml.jackson.databind.ObjectMapper', ...
    javaObject('org.msgpack.jackson.dataformat.MessagePackFactory'));
  socket.sendMore('simgl/1');
  socket.send(messagepack.writeValueAsBytes(json.readTree(request)), 0);
  while true % not the pong of a server that starts
    frames = javaMethod('recvMsg', 'org.zeromq.ZMsg', socket);
    if isempty(frames), error('no answer in time'); end
    frames.pop();
    packed = frames.pop();
    header = messagepack.readTree(packed.getData());
    if strcmp(text(header, '/type'), kind), return; end
    if strcmp(text(header, '/type'), 'error'), error('%s: %s', text(header, '/code'), text(header, '/detail')); end
    if strcmp(text(header, '/type'), 'bye'), error('the server said goodbye'); end
  end
end

function value = text(header, place) % by a JSON pointer
  node = header.at(place);
  value = char(node.asText());
end
