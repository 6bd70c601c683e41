// WebRTC viewers of a media server, for publish.py: they receive and decrypt, but do not decode.
//
//	viewers janus|whep ADDRESS COUNT
//
// ADDRESS is that of Janus's HTTP transport, whose streaming mountpoint 1 is watched, or a WHEP endpoint.
// Prints a line "connected N" when all have received a packet, then receives until its input ends, then prints
// "packets LEAST MEDIAN" of what each received meanwhile.
package main

import (
	"bytes"
	"crypto/tls"
	"encoding/json"
	"fmt"
	"io"
	"log"
	"net/http"
	"os"
	"sort"
	"strconv"
	"strings"
	"sync"
	"sync/atomic"

	"github.com/pion/webrtc/v4"
)

type reply struct {
	Data struct {
		ID uint64 `json:"id"`
	} `json:"data"`
	JSEP webrtc.SessionDescription `json:"jsep"`
}

func ask(url string, body map[string]any) (reply, error) {
	var answer reply
	response, err := func() (*http.Response, error) {
		if body == nil {
			return http.Get(url)
		}
		body["transaction"] = "t"
		text, _ := json.Marshal(body)
		return http.Post(url, "application/json", bytes.NewReader(text))
	}()
	if err != nil {
		return answer, err
	}
	defer response.Body.Close()
	return answer, json.NewDecoder(response.Body).Decode(&answer)
}

// receiver makes a connection that counts its packets.
func receiver(packets *atomic.Int64, first func()) (*webrtc.PeerConnection, error) {
	peer, err := webrtc.NewPeerConnection(webrtc.Configuration{})
	if err != nil {
		return nil, err
	}
	peer.OnTrack(func(track *webrtc.TrackRemote, _ *webrtc.RTPReceiver) {
		for {
			if _, _, err := track.ReadRTP(); err != nil {
				return
			}
			if packets.Add(1) == 1 {
				first()
			}
		}
	})
	return peer, nil
}

// described returns the local description with all its candidates.
func described(peer *webrtc.PeerConnection, own webrtc.SessionDescription) (*webrtc.SessionDescription, error) {
	gathered := webrtc.GatheringCompletePromise(peer)
	if err := peer.SetLocalDescription(own); err != nil {
		return nil, err
	}
	<-gathered
	return peer.LocalDescription(), nil
}

func answerTo(offer webrtc.SessionDescription, packets *atomic.Int64, first func()) (*webrtc.SessionDescription, error) {
	peer, err := receiver(packets, first)
	if err != nil {
		return nil, err
	}
	if err := peer.SetRemoteDescription(offer); err != nil {
		return nil, err
	}
	answer, err := peer.CreateAnswer(nil)
	if err != nil {
		return nil, err
	}
	return described(peer, answer)
}

func watchWHEP(endpoint string, packets *atomic.Int64, first func()) error {
	peer, err := receiver(packets, first)
	if err != nil {
		return err
	}
	receiving := webrtc.RTPTransceiverInit{Direction: webrtc.RTPTransceiverDirectionRecvonly}
	if _, err := peer.AddTransceiverFromKind(webrtc.RTPCodecTypeVideo, receiving); err != nil {
		return err
	}
	offer, err := peer.CreateOffer(nil)
	if err != nil {
		return err
	}
	own, err := described(peer, offer)
	if err != nil {
		return err
	}
	response, err := http.Post(endpoint, "application/sdp", strings.NewReader(own.SDP))
	if err != nil {
		return err
	}
	defer response.Body.Close()
	answer, err := io.ReadAll(response.Body)
	if err != nil {
		return err
	}
	if response.StatusCode != http.StatusCreated {
		return fmt.Errorf("%s: %s", response.Status, answer)
	}
	return peer.SetRemoteDescription(webrtc.SessionDescription{Type: webrtc.SDPTypeAnswer, SDP: string(answer)})
}

func watchJanus(janus string, packets *atomic.Int64, first func()) error {
	session, err := ask(janus, map[string]any{"janus": "create"})
	if err != nil {
		return err
	}
	at := fmt.Sprintf("%s/%d", janus, session.Data.ID)
	handle, err := ask(at, map[string]any{"janus": "attach", "plugin": "janus.plugin.streaming"})
	if err != nil {
		return err
	}
	plugin := fmt.Sprintf("%s/%d", at, handle.Data.ID)
	message := func(request string) map[string]any {
		return map[string]any{"janus": "message", "body": map[string]any{"request": request, "id": 1}}
	}
	if _, err := ask(plugin, message("watch")); err != nil {
		return err
	}
	event, err := ask(at+"?maxev=1", nil)
	if err != nil {
		return err
	}
	answer, err := answerTo(event.JSEP, packets, first)
	if err != nil {
		return err
	}
	start := message("start")
	start["jsep"] = answer
	_, err = ask(plugin, start)
	return err
}

func main() {
	// The certificate of a media server that runs for this measurement is signed by itself.
	http.DefaultTransport.(*http.Transport).TLSClientConfig = &tls.Config{InsecureSkipVerify: true}
	watch := map[string]func(string, *atomic.Int64, func()) error{"janus": watchJanus, "whep": watchWHEP}[os.Args[1]]
	count, err := strconv.Atoi(os.Args[3])
	if err != nil {
		log.Fatal(err)
	}
	packets := make([]atomic.Int64, count)
	var waiting sync.WaitGroup
	waiting.Add(count)
	for i := range packets {
		if err := watch(os.Args[2], &packets[i], waiting.Done); err != nil {
			log.Fatal(err)
		}
	}
	waiting.Wait()
	fmt.Println("connected", count)
	before := make([]int64, count)
	for i := range packets {
		before[i] = packets[i].Load()
	}
	io.Copy(io.Discard, os.Stdin)
	received := make([]int64, count)
	for i := range packets {
		received[i] = packets[i].Load() - before[i]
	}
	sort.Slice(received, func(a, b int) bool { return received[a] < received[b] })
	if count > 0 {
		fmt.Println("packets", received[0], received[count/2])
	}
}
