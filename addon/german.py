"""German, by the English. In the sentences, what stands in braces is filled in; see translations.py."""

from __future__ import annotations

WORDS = {
    # Panels and buttons
    "Radiosity": "Radiosity",
    "Active Object": "Aktives Objekt",
    "Last Bake": "Letztes Backen",
    "Check and Plan": "Prüfen und planen",
    "Advanced": "Erweitert",
    "Light": "Licht",
    "Bake Again": "Neu backen",
    "Clear": "Entfernen",
    "Nothing stands in the way": "Nichts steht im Weg",
    "Not Simulated": "Nicht simuliert",
    "Changed since: check again": "Seitdem geändert: erneut prüfen",
    "Bake Radiosity": "Radiosity backen",
    "Cancel Bake": "Backen abbrechen",
    "Stop and Keep": "Anhalten und behalten",
    "Switch Effect": "Effekt umschalten",
    "Fix": "Beheben",
    "Choose Accuracy": "Genauigkeit wählen",
    "Refine": "Verfeinern",
    "Clear Baked Light": "Gebackenes Licht löschen",
    "Show Baked Light": "Gebackenes Licht zeigen",
    "Restore Viewport": "Ansicht zurücksetzen",
    "Show in Materials": "In Materialien zeigen",
    "Multiply with Colors": "Mit Farben malnehmen",
    "Restore Materials": "Materialien zurückgeben",
    "Radiosity Presets": "Radiosity-Vorgaben",
    "Add Radiosity Preset": "Radiosity-Vorgabe hinzufügen",
    "Choose Preset": "Vorgabe wählen",
    "Preset": "Vorgabe",
    "Draft": "Entwurf",
    "Preview": "Vorschau",
    "Production": "Endfassung",
    # Settings
    "Bake for": "Ziel",
    "Error": "Fehler",
    "Time": "Zeit",
    "Result": "Ergebnis",
    "Tessellation": "Unterteilung",
    "Count": "Anzahl",
    "Length": "Länge",
    "Form Factors": "Formfaktoren",
    "Seed": "Startwert",
    "Threads": "Threads",
    "Layers": "Ebenen",
    "Layer": "Ebene",
    "Attribute": "Attribut",
    "Domain": "Bereich",
    "Data Type": "Datentyp",
    "Exposure": "Belichtung",
    "Show While Baking": "Während des Backens zeigen",
    "Show When Done": "Am Ende zeigen",
    "Report": "Bericht",
    "Effects": "Effekte",
    "Plan": "Plan",
    "Receives": "Empfängt",
    "Casts": "Wirft Schatten",
    "Bounces": "Reflektiert",
    "Own Tessellation": "Eigene Unterteilung",
    "Longest Edge": "Längste Kante",
    # Choices
    "Combined": "Kombiniert",
    "Direct": "Direkt",
    "Indirect": "Indirekt",
    "Emission": "Emission",
    "Sky": "Himmel",
    "Unreached": "Unerreicht",
    "Escaped": "Entkommen",
    "Accuracy": "Güte",
    "New Object": "Neues Objekt",
    "Replace": "Ersetzen",
    "Keep Topology": "Topologie behalten",
    "Triangles": "Dreiecke",
    "Automatic": "Automatisch",
    "Hemisphere": "Halbkugel",
    "Analytic": "Analytisch",
    "Centroid": "Schwerpunkt",
    "Face Corner": "Flächenecke",
    "Vertex": "Punkt",
    "Color": "Farbe",
    "Byte Color": "Byte Farbe",
    # Tooltips
    "A colour for each corner of each face: edges stay sharp": "Eine Farbe für jede Ecke jeder Fläche: Kanten bleiben "
    "scharf",
    "A colour for each vertex, the mean of the corners that meet there": "Eine Farbe für jeden Punkt, das Mittel der "
    "Ecken dort",
    "Floats: any brightness": "Gleitkommazahlen: jede Helligkeit",
    "8 bits for each channel: a quarter of the memory, and light above 1 is cut off": "8 Bit je Kanal: ein Viertel des "
    "Speichers, und Licht über 1 wird abgeschnitten",
    "What has a colour of its own": "Was eine eigene Farbe hat",
    "How the colours are stored": "Wie die Farben gespeichert werden",
    "Stops by which the light is made brighter before it is stored; the mesh keeps the factor, to divide "
    "by": "Blendenstufen, um die das Licht vor dem Speichern heller wird; das Netz merkt sich den Faktor zum Teilen",
    "Emitted plus reflected light: what the surface looks like": "Abgegebenes und reflektiertes Licht: wie die "
    "Fläche aussieht",
    "The light that arrives, without the surface's own colour": "Das einfallende Licht, ohne die Farbe der Fläche",
    "Reflected light that came straight from lamps, emitting surfaces and the sky": "Reflektiertes Licht, das "
    "geradewegs von Lampen, leuchtenden Flächen und dem Himmel kam",
    "Reflected light that bounced at least once": "Reflektiertes Licht nach mindestens einer Reflexion",
    "The light the surface gives off by itself": "Das Licht, das die Fläche selbst abgibt",
    "Reflected light that came straight from the sky": "Reflektiertes Licht, das geradewegs vom Himmel kam",
    "How far the combined light may be off, as the bake itself estimates it": "Wie weit das Gesamtlicht daneben liegen "
    "kann, nach eigener Schätzung",
    "Loud colours where nothing is seen of the surface and light was filled in": "Laute Farben, wo niemand die Fläche "
    "sieht und Licht ergänzt wurde",
    "The share of what surrounds the surface that is open to the void: holes are bright": "Der Anteil der Umgebung, "
    "der ins Leere offen ist: Löcher sind hell",
    "A colour of its own for every triangle, to see how finely the surface is split": "Eine eigene Farbe für jedes "
    "Dreieck, um die Unterteilung zu sehen",
    "Bake until the estimated error is as small as asked": "Backen, bis der geschätzte Fehler klein genug ist",
    "Make the best of a given time": "Das Beste aus der gegebenen Zeit machen",
    "Leave the objects alone, and add a tessellated copy of each that carries the light": "Die Objekte in Ruhe lassen "
    "und je eine unterteilte Kopie anlegen, die das Licht trägt",
    "Tessellate the objects' own meshes, and write the light to them": "Die Netze der Objekte selbst unterteilen und "
    "das Licht dorthin schreiben",
    "Write the light to the corners the meshes have, without adding any": "Das Licht in die vorhandenen Ecken "
    "schreiben, ohne neue anzulegen",
    "Choose the size of the triangles so that about this many result": "Die Größe der Dreiecke so wählen, dass etwa so "
    "viele entstehen",
    "Split triangles until no edge is longer than this": "Dreiecke teilen, bis keine Kante länger ist",
    "Choose by the number of patches": "Nach der Zahl der Flächenstücke wählen",
    "Cast rays over each patch's hemisphere: cost grows in line with the patches": "Strahlen über die Halbkugel jedes "
    "Flächenstücks: der Aufwand wächst mit ihrer Zahl",
    "Lambert's exact formula for every pair of patches: smooth, for small scenes": "Lamberts genaue Formel für jedes "
    "Paar von Flächenstücken: glatt, für kleine Szenen",
    "The classic formula between centres: wrong where surfaces meet, for comparison only": "Die klassische Formel "
    "zwischen Mittelpunkten: falsch, wo Flächen sich berühren, nur zum Vergleich",
    "What ends the bake: an accuracy that is reached, or a time that is up": "Was das Backen beendet: eine erreichte "
    "Genauigkeit oder eine abgelaufene Zeit",
    "How far the baked light may be off on average, compared with the mean light of the surfaces": "Wie weit das Licht "
    "im Mittel daneben liegen darf, verglichen mit dem mittleren Licht der Flächen",
    "How long the bake may take": "Wie lange das Backen dauern darf",
    "Where the baked light goes": "Wohin das gebackene Licht kommt",
    "How finely the objects are split, so that their vertices can hold shadows": "Wie fein die Objekte unterteilt "
    "werden, damit ihre Punkte Schatten zeigen können",
    "About how many triangles all baked objects have together after the split": "Wie viele Dreiecke alle gebackenen "
    "Objekte nach der Unterteilung zusammen etwa haben",
    "The longest edge a triangle may have after the split": "Die längste Kante, die ein Dreieck danach haben darf",
    "How the exchange of light between the patches is computed": "Wie der Austausch von Licht zwischen den "
    "Flächenstücken berechnet wird",
    "Start of the random numbers: the same seed gives the same bake, to the last bit": "Beginn der Zufallszahlen: der "
    "gleiche Startwert gibt das gleiche Ergebnis, bis aufs letzte Bit",
    "Number of processor cores to use; 0 uses all of them": "Zahl der Prozessorkerne; 0 nimmt alle",
    "Kinds of light to store in colour attributes of their own (hold Shift to choose several). Combined is always "
    "among them": "Arten von Licht, die eigene Farbattribute bekommen (mehrere mit Umschalt). Kombiniert ist immer "
    "dabei",
    "Name of the colour attribute that holds the combined light; the other layers add theirs to it": "Name des "
    "Farbattributs mit dem Gesamtlicht; die anderen Ebenen hängen ihren an",
    "Show the light in the viewport as far as it has come, pass by pass": "Das Licht in der Ansicht zeigen, so weit es "
    "gekommen ist",
    "Show the baked light in the viewport as soon as it is there": "Das gebackene Licht zeigen, sobald es da ist",
    "The layer that the viewport shows on the baked objects": "Die Ebene, die die Ansicht auf den Objekten zeigt",
    "What the last bake did, as the report.json of the command line": "Was das letzte Backen tat, wie report.json der "
    "Befehlszeile",
    "Effects that are simulated, or not, whatever the scene calls for": "Effekte, die simuliert werden oder nicht, was "
    "auch immer die Szene verlangt",
    "What the next bake would simulate, and what it would cost": "Was das nächste Backen simulieren und kosten würde",
    "Bake light onto this object, when it is among those to bake": "Licht auf dieses Objekt backen, wenn es an der "
    "Reihe ist",
    "Let this object stand in the way of light, and cast shadows": "Dieses Objekt steht dem Licht im Weg und wirft "
    "Schatten",
    "Let this object reflect light onto others, and give off its own": "Dieses Objekt wirft Licht auf andere, auch "
    "eigenes",
    "Split this object to a size of its own": "Dieses Objekt nach eigenem Maß unterteilen",
    "The longest edge a triangle of this object may have after the split": "Die längste Kante, die ein Dreieck dieses "
    "Objekts danach haben darf",
    "Bake the light of the whole scene into colour attributes of the selected mesh objects, or of all mesh objects "
    "when none is selected": "Das Licht der ganzen Szene in Farbattribute der gewählten Netzobjekte backen, oder "
    "aller, wenn keines gewählt ist",
    "Find out what stands in the way of a good bake, which effects of light this scene calls for, and what the bake "
    "would cost": "Herausfinden, was einem guten Ergebnis im Weg steht, welche Effekte die Szene verlangt und was das "
    "Backen kosten würde",
    "Simulate this effect, or do not, whatever the scene calls for. Again leaves it to the scene": "Diesen Effekt "
    "simulieren oder nicht, was auch immer die Szene verlangt. Noch einmal überlässt es der Szene",
    "Mend this, as an ordinary edit that can be undone": "Dies beheben, als gewöhnliche Änderung, die sich "
    "zurücknehmen lässt",
    "Bake for this error": "Auf diesen Fehler hin backen",
    "Ask for half the error, and bake again": "Den halben Fehler verlangen und erneut backen",
    "Remove all baked light of this scene: the copies and their collection, and the colour attributes that were made. "
    "The originals are shown again as they were": "Alles gebackene Licht dieser Szene entfernen: die Kopien und ihre "
    "Sammlung, und die angelegten Farbattribute. Die Originale sind wieder zu sehen wie zuvor",
    "Stop the bake and leave everything as it was": "Das Backen anhalten und alles lassen, wie es war",
    "Stop the bake, and keep the light as far as it has come": "Das Backen anhalten und das Licht behalten, so weit es "
    "gekommen ist",
    "Keep these settings as a preset, or remove one": "Diese Einstellungen als Vorgabe behalten, oder eine entfernen",
    "Use the settings of this preset": "Die Einstellungen dieser Vorgabe verwenden",
    "A quick look: coarse and 10 % off": "Ein schneller Blick: grob und um 10 % daneben",
    "Good enough to judge the light by": "Gut genug, um das Licht zu beurteilen",
    "For keeps: fine and 1 % off": "Zum Behalten: fein und um 1 % daneben",
    "Show the baked light in the 3D View: solid shading, flat light, attribute colours": "Das gebackene Licht in der "
    "3D-Ansicht zeigen: solide Schattierung, flaches Licht, Attributfarben",
    "Give the 3D View back the shading it had before it showed the baked light": "Der 3D-Ansicht die Schattierung "
    "zurückgeben, die sie vorher hatte",
    "Let the baked objects give off their active layer in Material Preview and renders, without lamps": "Die Objekte "
    "geben in Materialvorschau und Rendern ihre aktive Ebene ab, ohne Lampen",
    "Let the baked objects give off the layer Light times the colours of their materials, textures included, in "
    "Material Preview and renders": "Die Objekte geben in Materialvorschau und Rendern die Ebene Licht mal der Farben "
    "ihrer Materialien ab, mit Texturen",
    "Give the baked objects the materials back that they had before they showed the light": "Den Objekten die "
    "Materialien zurückgeben, die sie vorher hatten",
    # What is said of a bake
    "Baked": "Gebacken",
    "Estimated Error": "Geschätzter Fehler",
    "Memory": "Speicher",
    "About {amount}": "Etwa {amount}",
    "Bakes all meshes": "Backt alle Netze",
    "Bakes the selection: {some} of {all} meshes": "Backt die Auswahl: {some} von {all} Netzen",
    "object": "Objekt",
    "objects": "Objekte",
    "triangle": "Dreieck",
    "triangles": "Dreiecke",
    "Cancelling": "Bricht ab",
    "Writing": "Schreibt",
    "Keeping": "Behält",
    "Waiting for Object Mode": "Wartet auf den Objektmodus",
    "Starting": "Starten",
    "Tessellate": "Unterteilen",
    "Transport": "Lichtaustausch",
    "Gather": "Sammeln",
    "Sampling": "Abtastung",
    "Resolution": "Auflösung",
    "error": "Fehler",
    "{time} so far": "{time} bisher",
    "about {time} left": "noch etwa {time}",
    "less than 0.1 %": "weniger als 0,1 %",
    "Baked {objects}, {triangles} in {seconds} s": "{objects}, {triangles} in {seconds} s gebacken",
    "{baked}, estimated error {error}": "{baked}, geschätzter Fehler {error}",
    "Estimated error {error}: {causes}": "Geschätzter Fehler {error}: {causes}",
    "sampling": "Abtastung",
    "transport": "Lichtaustausch",
    "resolution": "Auflösung",
    "Relight": "Neu beleuchten",
    "Of {emitted} given off, {absorbed} were absorbed and {escaped} escaped; {unaccounted} is not accounted "
    "for": "Von {emitted} wurden {absorbed} verschluckt und {escaped} entkamen; {unaccounted} sind ohne Nachweis",
    # The check list
    "Neighbouring faces look to different sides ({names}): {triangles}": "Benachbarte Flächen schauen nach "
    "verschiedenen Seiten ({names}): {triangles}",
    "Faces look inward ({names}), and what sees only backs counts as inside and is dark": "Flächen schauen nach innen "
    "({names}), und was nur Rückseiten sieht, gilt als innen und ist dunkel",
    "Faces lie exactly on others ({names}): {triangles}": "Flächen liegen genau auf anderen ({names}): {triangles}",
    "Faces have no area ({names}): {triangles}": "Flächen haben keinen Inhalt ({names}): {triangles}",
    "Materials reflect all light or more ({names}), which nothing real does": "Materialien reflektieren alles Licht "
    "oder mehr ({names}), was nichts Wirkliches tut",
    "Faces are larger than lamps are far ({names}), and hide the light between their corners: "
    "{triangles}": "Flächen sind größer als der Abstand der Lampen ({names}) und können das Licht zwischen ihren Ecken "
    "nicht zeigen: {triangles}",
    "Shares its mesh with others, and each gets different light: {names}": "Teilt sein Netz mit anderen, und jedes "
    "bekommt anderes Licht: {names}",
    "Is linked from another file, and cannot be written to: {names}": "Ist aus einer anderen Datei verknüpft und nicht "
    "zu beschreiben: {names}",
    "Has modifiers that change its faces: {names}": "Hat Modifikatoren, die seine Flächen ändern: {names}",
    "Nothing gives off light: no lamp, no emitting material, and a black world": "Nichts gibt Licht: keine Lampe, kein "
    "leuchtendes Material und eine schwarze Welt",
    "Needs about {needed} MB of memory, and {free} MB are free": "Braucht etwa {needed} MB Speicher, und {free} MB "
    "sind frei",
    "Recalculate Normals": "Normalen neu berechnen",
    "Flip Normals": "Normalen umkehren",
    "Remove Duplicates": "Doppelte entfernen",
    "Dissolve": "Auflösen",
    "Darken to 90 %": "Auf 90 % abdunkeln",
    "Bake a New Object": "Neues Objekt backen",
    "Make Single User": "Eigenes Netz geben",
    "Add a Sun": "Sonne hinzufügen",
    "Use Half the Triangles": "Halb so viele Dreiecke",
}

#: Effects of light, by their names.
WORDS |= {
    "point lamps": "Punktlampen",
    "spot lamps": "Spotlampen",
    "sun": "Sonne",
    "area lamps": "Flächenlampen",
    "shadows": "Schatten",
    "soft shadows": "Weiche Schatten",
    "emitting surfaces": "Leuchtende Flächen",
    "sky map": "Himmelsbild",
    "sky lights": "Helle Himmelsstellen",
    "portals": "Portale",
    "bounces": "Reflexionen",
    "sky": "Himmel",
    "transparency": "Durchsichtigkeit",
    "diffuse transmission": "Durchscheinen",
    "mirrors": "Spiegel",
    "clear glass": "Klares Glas",
    "colour": "Farbe",
    "albedo textures": "Farbtexturen",
    "textured emission": "Leuchttexturen",
}

#: Why an effect is simulated, or not.
SENTENCES = {
    "switched on by hand; {what}": "von Hand eingeschaltet; {what}",
    "switched off by hand; {what}": "von Hand ausgeschaltet; {what}",
    "{names} and {number} more": "{names} und {number} weitere",
    "none in the scene": "keine in der Szene",
    "no lamp has a size": "keine Lampe hat eine Größe",
    "{names} has a size": "{names} hat eine Größe",
    "{names} have a size": "{names} haben eine Größe",
    "no lamp casts any": "keine Lampe wirft welche",
    "nothing can stand between the lamps and the surfaces: all lie around them": "nichts kann zwischen Lampen und "
    "Flächen stehen: alle liegen um sie herum",
    "surfaces may stand in the light of lamps": "Flächen können im Licht von Lampen stehen",
    "no surface emits": "keine Fläche leuchtet",
    "{number} triangles emit; sampled {what}": "{number} Dreiecke leuchten; abgetastet {what}",
    "as lamps": "wie Lampen",
    "by the rays that look around": "von den Strahlen, die sich umsehen",
    "some of them at each point": "von jedem Punkt aus einige davon",
    "every ray that leaves a receiver hits something": "jeder Strahl von einem Empfänger trifft auf etwas",
    "the world emits light": "die Welt gibt Licht",
    "the world is black": "die Welt ist schwarz",
    "the world looks different from direction to direction": "die Welt sieht in jeder Richtung anders aus",
    "the world is the same in all directions": "die Welt ist in allen Richtungen gleich",
    "nothing in the sky is much brighter than the rest of it": "nichts am Himmel ist viel heller als der Rest",
    "a bright spot is sampled as a sun": "eine helle Stelle wird als Sonne abgetastet",
    "{number} bright spots are sampled as suns": "{number} helle Stellen werden als Sonnen abgetastet",
    "no area lamp is a portal, and rays find the sky well enough": "keine Flächenlampe ist ein Portal, und Strahlen "
    "finden den Himmel gut genug",
    "the sky shines through {names}": "der Himmel scheint durch {names}",
    "the sky shines through an opening that was found": "der Himmel scheint durch eine gefundene Öffnung",
    "the sky shines through {number} openings that were found": "der Himmel scheint durch {number} gefundene Öffnungen",
    "the sky shines through {names} and an opening that was found": "der Himmel scheint durch {names} und eine "
    "gefundene Öffnung",
    "the sky shines through {names} and {number} openings that were found": "der Himmel scheint durch {names} und "
    "{number} gefundene Öffnungen",
    "{name} is coloured": "{name} ist farbig",
    "the sky is coloured": "der Himmel ist farbig",
    "what lets light through or mirrors it is followed in three channels": "was Licht durchlässt oder spiegelt, wird "
    "in drei Kanälen verfolgt",
    "one channel: all light and all surfaces are grey": "ein Kanal: alles Licht und alle Flächen sind grau",
    "every surface is black": "jede Fläche ist schwarz",
    "as the original program did: centroid form factors, plain shooting": "wie im ursprünglichen Programm: "
    "Schwerpunkt-Formfaktoren, einfaches Verteilen",
    "all at once, for fewer take no less time: surfaces reflect {share}, and bounce {number} adds {rest} in a closed "
    "room": "alle auf einmal, denn weniger sparen keine Zeit: Flächen reflektieren {share}, und Reflexion {number} "
    "bringt in einem geschlossenen Raum {rest}",
    "surfaces reflect {share} at most: no bounce would show": "Flächen reflektieren höchstens {share}: keine Reflexion "
    "wäre zu sehen",
    "every surface is opaque": "jede Fläche ist undurchsichtig",
    "{names} let light through": "{names} lassen Licht durch",
    "{names} cast no shadow": "{names} werfen keinen Schatten",
    "{names} let light through; {what}": "{names} lassen Licht durch; {what}",
    "light that falls on one side of {names} leaves on the other too": "Licht, das auf eine Seite von {names} fällt, "
    "verlässt auch die andere",
    "no surface is translucent": "keine Fläche ist durchscheinend",
    "{names} reflect rays on": "{names} werfen Strahlen weiter",
    "no surface mirrors": "keine Fläche spiegelt",
    "rays go straight through {names}": "Strahlen gehen gerade durch {names}",
    "no surface is clear glass": "keine Fläche ist klares Glas",
    "the colour changes over {names}": "die Farbe ändert sich auf {names}",
    "every surface has one colour": "jede Fläche hat eine Farbe",
    "what shines changes over {names}": "was leuchtet, ändert sich auf {names}",
    "no surface emits more in one place than in another": "keine Fläche leuchtet an einer Stelle mehr als an anderen",
}

#: What is said of a scene that is not quite as it should be.
SENTENCES |= {
    "Material '{name}' {what}": "Material '{name}' {what}",
    "World '{name}' {what}": "Welt '{name}' {what}",
    "Lamp '{name}' {what}": "Lampe '{name}' {what}",
    "has no shader at its surface output, so it is black. Connect one, for example a Diffuse "
    "BSDF.": "hat keinen Shader am Flächenausgang und ist daher schwarz. Einen verbinden, zum Beispiel einen Diffuse "
    "BSDF.",
    "uses the node {node}, which has no diffuse part or is not read yet: it is taken as black. Use Diffuse BSDF, "
    "Principled BSDF, Emission, Mix Shader or Add Shader.": "verwendet den Knoten {node}, der keinen matten Anteil hat "
    "oder noch nicht gelesen wird: er gilt als schwarz. Diffuse BSDF, Principled BSDF, Emission, Mix Shader oder Add "
    "Shader verwenden.",
    "takes its {socket} from the node {node}, which {what}: the plain value behind the link is used. Set that value to "
    "the average, or unlink it.": "bekommt {socket} vom Knoten {node}; er {what}: es gilt der einfache Wert hinter der "
    "Verbindung. Ihn auf den Mittelwert setzen oder die Verbindung lösen.",
    "is not read yet": "wird noch nicht gelesen",
    "mixes shaders, which {what}.": "mischt Shader; dabei: {what}.",
    "mixes a colour attribute with other colours: it is left out.": "mischt ein Farbattribut mit anderen Farben: es "
    "bleibt weg.",
    "combines images of different sizes: their means are used.": "verbindet Bilder verschiedener Größe: es gelten ihre "
    "Mittelwerte.",
    "lies otherwise on the faces than another image": "liegt anders auf den Flächen als ein anderes Bild",
    "adds something to an image that is clipped": "fügt einem begrenzten Bild etwas hinzu",
    "takes its place from the node {node}": "bekommt seinen Ort vom Knoten {node}",
    "projects its image as a {kind}": "projiziert sein Bild als {kind}",
    "has an image, '{name}', {what}": "hat ein Bild, '{name}', {what}",
    "of the kind {kind}": "von der Art {kind}",
    "in the colour space {name}": "im Farbraum {name}",
    "of floating-point pixels with a straight alpha": "mit Gleitkommawerten und unverrechnetem Alpha",
    "mixes numbers or vectors": "mischt Zahlen oder Vektoren",
    "mixes colours by {kind}": "mischt Farben durch {kind}",
    "separates a colour into {kind}": "zerlegt eine Farbe in {kind}",
    "calculates {kind}": "rechnet {kind}",
    "shows pink, as in a render, because {what}: find the file, or choose another image.": "zeigt Rosa, wie beim "
    "Rendern, denn {what}: die Datei suchen oder ein anderes Bild wählen.",
    "the image '{name}' has no pixels": "das Bild '{name}' hat keine Bildpunkte",
    "its node {name} has no image": "sein Knoten {name} hat kein Bild",
    "has a metal by index of refraction and extinction: its base colour is used. Choose F82 "
    "Tint.": "hat ein Metall nach Brechungsindex und Extinktion: es gilt seine Grundfarbe. F82 Tint wählen.",
    "is glass of roughness {number}: light goes straight through it in the bake, and is not scattered. For frosted "
    "glass mix in a Translucent BSDF.": "ist Glas der Rauheit {number}: Licht geht beim Backen gerade hindurch und "
    "wird nicht gestreut. Für Milchglas einen Translucent BSDF beimischen.",
    "is not the same from behind: its front is used for both sides.": "ist von hinten anders: für beide Seiten gilt "
    "die Vorderseite.",
    "reflects more than it receives; its colour is limited to {number}. Lower the base "
    "colour.": "reflektiert mehr, als es bekommt; seine Farbe wird auf {number} begrenzt. Die Grundfarbe senken.",
    "Material '{name}' reflects all light or more; {share} is used. Nothing real is whiter than fresh snow at 90 %: "
    "pick a darker colour.": "Material '{name}' reflektiert alles Licht oder mehr; es gilt {share}. Nichts Wirkliches "
    "ist weißer als frischer Schnee mit 90 %: eine dunklere Farbe wählen.",
    "Material '{name}' has a colour that is negative or not a number: pick another.": "Material '{name}' hat eine "
    "Farbe, die negativ oder keine Zahl ist: eine andere wählen.",
    "Material '{name}' has an image with values that are negative or not numbers.": "Material '{name}' hat ein Bild "
    "mit Werten, die negativ oder keine Zahlen sind.",
    "Cycles could not sample the materials, so plain values are used: {what}": "Cycles konnte die Materialien nicht "
    "abtasten, daher gelten einfache Werte: {what}",
    "the add-on Cycles Render Engine is disabled": "das Add-on Cycles Render Engine ist abgeschaltet",
    "World '{name}' is filled with a volume, which is not baked: its light is not dimmed.": "Welt '{name}' ist mit "
    "einem Volumen gefüllt, das nicht gebacken wird: sein Licht wird nicht gedämpft.",
    "World '{name}' {what}. A plain colour is used.": "Welt '{name}' {what}. Es gilt eine einfache Farbe.",
    "could not be evaluated by Cycles ({problem}): switch the add-on Cycles on": "konnte von Cycles nicht ausgewertet "
    "werden ({problem}): das Add-on Cycles einschalten",
    "Light linking of '{name}' is not baked: it shines on everything, and everything stands in its "
    "light.": "Lichtverknüpfung von '{name}' wird nicht gebacken: es scheint auf alles, und alles steht in seinem "
    "Licht.",
    "Lamp '{name}' takes light away (negative strength): it is left out. Make its energy "
    "positive.": "Lampe '{name}' nimmt Licht weg (negative Stärke): sie bleibt weg. Ihre Energie positiv machen.",
    "Lamp '{name}' is scaled to nothing along an axis: it is left out. Give it a scale of 1.": "Lampe '{name}' ist "
    "entlang einer Achse auf nichts skaliert: sie bleibt weg. Ihr eine Skalierung von 1 geben.",
    "Lamp '{name}' has no area, so it gives no light. Give it a size.": "Lampe '{name}' hat keine Fläche und gibt kein "
    "Licht. Ihr eine Größe geben.",
    "Lamp '{name}' has a value that is not a number: check its transform and its power.": "Lampe '{name}' hat einen "
    "Wert, der keine Zahl ist: ihre Transformation und Leistung prüfen.",
    "Lamp '{name}' has no area to shine from: give it a size, or make it a point lamp.": "Lampe '{name}' hat keine "
    "Fläche zum Leuchten: ihr eine Größe geben oder eine Punktlampe daraus machen.",
    "The sky has a colour that is negative or not a number: check the nodes of the world.": "Der Himmel hat eine "
    "Farbe, die negativ oder keine Zahl ist: die Knoten der Welt prüfen.",
    "The scene is {number} times its own size away from the origin, where Blender's coordinates are coarse: move it "
    "nearer for an exact bake.": "Die Szene ist das {number}-fache ihrer Größe vom Ursprung entfernt, wo Blenders "
    "Koordinaten grob sind: sie für genaues Backen näher rücken.",
    "Object '{name}' is visible to some rays only (Ray Visibility): all see it in the bake.": "Objekt '{name}' ist nur "
    "für manche Strahlen sichtbar: beim Backen sehen es alle.",
    "Object '{name}' is a holdout or shadow catcher: it is baked as a usual one.": "Objekt '{name}' ist eine "
    "Aussparung oder ein Schattenfänger: es wird wie ein gewöhnliches gebacken.",
}

#: What a bake itself has to say.
SENTENCES |= {
    "No light is found: the world shines, but no ray from the baked objects has left the scene. If there is an "
    "opening, place an area lamp in it, facing inward, and switch on its Portal.": "Kein Licht gefunden: die Welt "
    "leuchtet, aber kein Strahl von den gebackenen Objekten hat die Szene verlassen. Gibt es eine Öffnung, eine "
    "Flächenlampe hineinsetzen, nach innen gerichtet, und ihr Portal einschalten.",
    "The estimated error is larger than the light itself: a few places are far brighter than all others, as where a "
    "lamp touches a surface. The Error layer shows where; there only much smaller triangles help, or moving the lamp "
    "away.": "Der geschätzte Fehler ist größer als das Licht selbst: wenige Stellen sind weit heller als alle anderen, "
    "etwa wo eine Lampe eine Fläche berührt. Die Ebene Fehler zeigt, wo; dort helfen nur viel kleinere Dreiecke, oder "
    "die Lampe wegzurücken.",
    "The estimated error is {error}, more than the {asked} asked for; most of it is {what}: "
    "{remedy}.": "Der geschätzte Fehler ist {error}, mehr als die verlangten {asked}; das meiste davon: {what}. "
    "Abhilfe: {remedy}.",
    "allow more time, or ask for a smaller error, which makes all that is sampled finer": "mehr Zeit geben, oder einen "
    "kleineren Fehler verlangen, der alles Abgetastete verfeinert",
    "ask for a smaller error, which makes the patches finer": "einen kleineren Fehler verlangen, der die Flächenstücke "
    "verfeinert",
    "use more and smaller triangles": "mehr und kleinere Dreiecke verwenden",
    "subdivide the mesh, or do not keep it": "das Netz unterteilen, oder es nicht behalten",
    "The bake took {seconds} s, more than the {asked} s asked for: {number} triangles take that long even with few "
    "rays. Allow more time, or simplify the meshes or bake fewer objects.": "Das Backen dauerte {seconds} s, mehr als "
    "die verlangten {asked} s: {number} Dreiecke brauchen auch mit wenigen Strahlen so lange. Mehr Zeit geben, die "
    "Netze vereinfachen oder weniger Objekte backen.",
    "Bytes hold values up to 1, and those from there to {most} were cut off: bake with an exposure of {stops} stops, "
    "or to float colours.": "Bytes fassen Werte bis 1, und die von dort bis {most} wurden abgeschnitten: mit einer "
    "Belichtung von {stops} backen, oder als Gleitkommafarben.",
    "The bake was stopped early: bake again for the accuracy that was asked for.": "Das Backen wurde früh angehalten: "
    "für die verlangte Genauigkeit erneut backen.",
    "Bake cancelled, nothing was changed": "Backen abgebrochen, nichts wurde geändert",
    "The bake was cancelled; nothing was changed.": "Das Backen wurde abgebrochen; nichts wurde geändert.",
    "The bake failed, see the console for details. {kind}: {problem}": "Das Backen schlug fehl, Näheres in der "
    "Konsole. {kind}: {problem}",
    "The bake was never started.": "Das Backen wurde nie begonnen.",
}

#: What cannot be baked, and what to do about it.
SENTENCES |= {
    "A bake is already running": "Es wird bereits gebacken",
    "A bake is already running: wait for it, or cancel it in the Radiosity panel.": "Es wird bereits gebacken: warten, "
    "oder im Bereich Radiosity abbrechen.",
    "Switch to Object Mode to bake": "Zum Backen in den Objektmodus wechseln",
    "Nothing to bake: no object with faces was chosen. Select a mesh object and bake again.": "Nichts zu backen: kein "
    "Objekt mit Flächen ist gewählt. Ein Netzobjekt wählen und erneut backen.",
    "Nothing to bake: the faces of {names} have no area. Check its scale, or delete them.": "Nichts zu backen: die "
    "Flächen von {names} haben keinen Inhalt. Skalierung prüfen, oder sie löschen.",
    "'{name}' is too long a name for an attribute: choose a shorter one than '{attribute}'.": "'{name}' ist als Name "
    "eines Attributs zu lang: einen kürzeren als '{attribute}' wählen.",
    "'{name}' is lost in a scene of {extent} m, where nothing so small can be told apart: move '{far}' nearer, or "
    "delete its vertices that are far away.": "'{name}' geht in einer Szene von {extent} m verloren, in der nichts so "
    "Kleines zu unterscheiden ist: '{far}' näher heranrücken oder dessen weit entfernte Eckpunkte löschen.",
    "Scene '{name}' has no mesh object that is visible to rendering: add one, or switch its camera icon on in the "
    "Outliner.": "Szene '{name}' hat kein Netzobjekt, das beim Rendern sichtbar ist: eines hinzufügen oder sein "
    "Kamerasymbol in der Gliederung einschalten.",
    "Scene '{name}' has no light, so all would be black: add a lamp, give a material emission, or give the world a "
    "colour.": "Szene '{name}' hat kein Licht, alles wäre schwarz: eine Lampe hinzufügen, ein Material leuchten lassen "
    "oder der Welt eine Farbe geben.",
    "There is no object '{name}' in view layer '{layer}' of scene '{scene}': {what}.": "Es gibt kein Objekt '{name}' "
    "in der Ansichtsebene '{layer}' der Szene '{scene}': {what}.",
    "put it into a collection that is not excluded": "es in eine Sammlung legen, die nicht ausgeschlossen ist",
    "check the spelling": "die Schreibweise prüfen",
    "Object '{name}' is not a mesh ({kind}), so it has no colour attribute: convert it to a mesh (Object > Convert), "
    "or leave it out.": "Objekt '{name}' ist kein Netz ({kind}) und hat kein Farbattribut: es in ein Netz umwandeln "
    "(Objekt > Umwandeln) oder weglassen.",
    "Object '{name}' is hidden from rendering: switch the camera icon of it and its collections on in the Outliner, or "
    "leave it out.": "Objekt '{name}' ist beim Rendern verborgen: das Kamerasymbol von ihm und seinen Sammlungen in "
    "der Gliederung einschalten oder es weglassen.",
    "Object '{name}' has no faces that render: give it some, or leave it out.": "Objekt '{name}' hat keine Flächen zum "
    "Rendern: ihm welche geben oder es weglassen.",
    "Object '{name}' has coordinates that are not numbers (NaN or infinite): delete those vertices, or check its "
    "modifiers.": "Objekt '{name}' hat Koordinaten, die keine Zahlen sind (NaN oder unendlich): diese Punkte löschen "
    "oder seine Modifikatoren prüfen.",
    "Object '{name}' has modifiers that change its faces, so the light has no corners to go to: choose the result New "
    "Object, or apply the modifiers.": "Objekt '{name}' hat Modifikatoren, die seine Flächen ändern, sodass das Licht "
    "keine Ecken findet: das Ergebnis Neues Objekt wählen oder die Modifikatoren anwenden.",
    "Object '{name}' shares its mesh '{mesh}' with others, and each gets different light: make it a single user "
    "(Object > Relations > Make Single User), or choose the result New Object.": "Objekt '{name}' teilt sein Netz "
    "'{mesh}' mit anderen, und jedes bekommt anderes Licht: ihm ein eigenes geben (Objekt > Beziehungen), oder das "
    "Ergebnis Neues Objekt wählen.",
    "Object '{name}' has shape keys, which a tessellated mesh cannot keep: choose the result New Object or "
    "Keep.": "Objekt '{name}' hat Formschlüssel, die ein unterteiltes Netz nicht behalten kann: das Ergebnis Neues "
    "Objekt oder Topologie behalten wählen.",
    "Object '{name}' is linked from another file: make it local (Object > Relations > Make Local), or choose the "
    "result New Object.": "Objekt '{name}' ist aus einer anderen Datei verknüpft: es lokal machen (Objekt > "
    "Beziehungen), oder das Ergebnis Neues Objekt wählen.",
    "Object '{name}' is in Edit Mode: leave it (Tab), or choose the result New Object.": "Objekt '{name}' ist im "
    "Bearbeitungsmodus: ihn verlassen (Tab), oder das Ergebnis Neues Objekt wählen.",
    "Object '{name}' was removed during the bake: put it back and bake again.": "Objekt '{name}' wurde während des "
    "Backens entfernt: es zurückholen und erneut backen.",
    "The mesh of object '{name}' was changed during the bake: bake again.": "Das Netz von Objekt '{name}' wurde "
    "während des Backens geändert: erneut backen.",
    "Mesh '{mesh}' of object '{name}' has an attribute '{attribute}' that this add-on did not make: rename or remove "
    "it, or bake to another attribute name.": "Netz '{mesh}' von Objekt '{name}' hat ein Attribut '{attribute}', das "
    "nicht von diesem Add-on stammt: es umbenennen oder entfernen, oder unter anderem Namen backen.",
    "The attribute has no name: give it one, for example 'Radiosity'.": "Das Attribut hat keinen Namen: ihm einen "
    "geben, zum Beispiel 'Radiosity'.",
    "No object receives light: switch Receives on for one (Radiosity panel, Active Object).": "Kein Objekt empfängt "
    "Licht: Empfängt bei einem einschalten (Bereich Radiosity, Aktives Objekt).",
    "No object casts shadows or bounces light: switch Casts on for at least one of them.": "Kein Objekt wirft Schatten "
    "oder reflektiert Licht: Wirft Schatten bei wenigstens einem einschalten.",
    "'{name}' has faces that use vertices which do not exist: run Mesh > Clean Up > "
    "Validate.": "'{name}' hat Flächen mit Punkten, die es nicht gibt: das Netz prüfen lassen.",
    "'{name}' has faces whose material does not exist: assign a material to all of them.": "'{name}' hat Flächen, "
    "deren Material es nicht gibt: allen ein Material zuweisen.",
    "'{name}' has vertices without finite coordinates: delete them, or undo what made them.": "'{name}' hat Punkte "
    "ohne endliche Koordinaten: sie löschen, oder rückgängig machen, woher sie kommen.",
    "'{name}' has UV coordinates that are not numbers: unwrap it again.": "'{name}' hat UV-Koordinaten, die keine "
    "Zahlen sind: es neu abwickeln.",
    "'{name}' has vertex colours that are negative or not numbers: paint it again.": "'{name}' hat Punktfarben, die "
    "negativ oder keine Zahlen sind: es neu bemalen.",
    "'{name}' has a textured material but no UV map: unwrap it, and bake again.": "'{name}' hat ein Material mit "
    "Textur, aber keine UV-Karte: es abwickeln und erneut backen.",
    "This bake would split the objects into {number} triangles and hold {memory} GB: choose a larger triangle size, or "
    "fewer triangles; {most} are the most.": "Dieses Backen würde die Objekte in {number} Dreiecke teilen und {memory} "
    "GB belegen: größere oder weniger Dreiecke wählen; mehr als {most} gehen nicht.",
    "The scene has more than {number} triangles, with all instances, and {free} MB of memory are free: hide from "
    "rendering what the light does not need, or lower subdivisions and the number of instances.": "Die Szene hat mit "
    "allen Instanzen mehr als {number} Dreiecke, und {free} MB Speicher sind frei: beim Rendern verbergen, was das "
    "Licht nicht braucht, oder Unterteilungen und Zahl der Instanzen senken.",
    "This bake would need about {needed} MB of memory, and {free} MB are free: ask for fewer triangles or a larger "
    "error, or close other programs.": "Dieses Backen brauchte etwa {needed} MB Speicher, und {free} MB sind frei: "
    "weniger Dreiecke oder einen größeren Fehler verlangen, oder andere Programme schließen.",
    "There is no effect '{name}': choose from {names}.": "Es gibt keinen Effekt '{name}': zur Wahl stehen {names}.",
    "There is no layer '{name}': choose from {names}.": "Es gibt keine Ebene '{name}': zur Wahl stehen {names}.",
}
