"""The words of the interface in other languages. Blender looks them up by their English."""

from __future__ import annotations

import bpy

GERMAN = {
    # Panels and buttons
    "Radiosity": "Radiosity",
    "Active Object": "Aktives Objekt",
    "Last Bake": "Letztes Backen",
    "Check and Plan": "Prüfen und planen",
    "Advanced": "Erweitert",
    "Light": "Licht",
    "Bake Again": "Erneut backen",
    "Clear": "Löschen",
    "Nothing stands in the way": "Nichts steht im Weg",
    "Not Simulated": "Nicht simuliert",
    "The scene has changed since": "Die Szene hat sich seitdem geändert",
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
    "Combined": "Gesamt",
    "Direct": "Direkt",
    "Indirect": "Indirekt",
    "Emission": "Emission",
    "Sky": "Himmel",
    "Unreached": "Unerreicht",
    "Escaped": "Entkommen",
    "Accuracy": "Genauigkeit",
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
    "Byte Color": "Byte-Farbe",
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
    "among them": "Arten von Licht, die eigene Farbattribute bekommen (mehrere mit Umschalt). Gesamt ist immer dabei",
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
    "Starting": "Beginnt",
    "Tessellate": "Unterteilen",
    "Transport": "Lichtaustausch",
    "Gather": "Sammeln",
    "Sampling": "Abtastung",
    "Resolution": "Auflösung",
    "error": "Fehler",
    "{time} so far": "{time} bisher",
    "about {time} left": "noch etwa {time}",
    "less than 0.1 %": "weniger als 0,1 %",
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
    "Flip Normals": "Normalen umdrehen",
    "Remove Duplicates": "Doppelte entfernen",
    "Dissolve": "Auflösen",
    "Darken to 90 %": "Auf 90 % abdunkeln",
    "Bake a New Object": "Neues Objekt backen",
    "Make Single User": "Eigenes Netz geben",
    "Add a Sun": "Sonne hinzufügen",
    "Use Half the Triangles": "Halb so viele Dreiecke",
}

#: Blender looks the names of operators up in a context of their own.
_CONTEXTS = ("*", "Operator")


def register() -> None:
    words = {(context, english): german for context in _CONTEXTS for english, german in GERMAN.items()}
    bpy.app.translations.register(__package__ or "radiosity_baker", {"de_DE": words})


def unregister() -> None:
    bpy.app.translations.unregister(__package__ or "radiosity_baker")
